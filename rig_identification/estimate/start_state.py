"""A run's own start state, everything else held: how a run is launched, and all that a held-out run gets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import (
    START_UNIT,
    Bench,
    Linearised,
    linearise_run,
    model_at,
    start_basis,
)
from rig_identification.estimate.unseen_swing import swing_belief
from rig_identification.model import layout
from rig_identification.model.motion import RigModel, State, on_cables

Array = NDArray[np.float64]

#: How far what swings or yields within the rig is from where it hangs when a run starts, in parts of how far
#: the body may be, and the rate (1/s) of that: fractions of a second tell both from one another badly.
INNER, INNER_RATE = 0.0005, 10.0


@dataclass(frozen=True)
class Doubts:
    """What rig and devices may be off by, to first order, taken out of a run's normal equations.

    With r = J_s c + J_d d + e, d ~ N(0, spread^2), e ~ N(0, 1), the best d for any c is linear, and what is
    left of information and cost is that of r with covariance 1 + spread^2 J_d J_d^T (Schur's complement).
    A level that is a milliradian off is then not taken for a body that starts somewhere else.
    """

    size: int  # of the parameters' vector
    spread: float  # std in tolerances; 0: no doubt

    def _columns(self, run: Linearised) -> tuple[Array, Array]:
        """(covariance (d, d) of the doubts given the run and its start, J_d (m, d))."""
        columns = run.jacobian[:, INERTIAL : self.size]
        inside = columns.T @ columns + np.eye(columns.shape[1]) / self.spread**2
        return np.linalg.inv(inside), columns

    def eliminated(self, run: Linearised) -> tuple[Array, Array]:
        """Information (s, s) and gradient (s,) of the start state."""
        own = run.jacobian[:, self.size :]
        information, gradient = own.T @ own, own.T @ run.residual
        if self.spread == 0.0:
            return information, gradient
        covariance, columns = self._columns(run)
        across = own.T @ columns
        return (
            information - across @ covariance @ across.T,
            gradient - across @ covariance @ (columns.T @ run.residual),
        )

    def cost(self, run: Linearised) -> float:
        """The run's cost with the doubts at their best."""
        if self.spread == 0.0:
            return run.cost
        covariance, columns = self._columns(run)
        pull = columns.T @ run.residual
        return run.cost - 0.5 * float(pull @ covariance @ pull)


def fit_start(
    bench: Bench,
    run: Run,
    theta: Array,
    start: State,
    *,
    iterations: int = 20,
    tolerance: float = 1e-3,
    extra_noise: Array | None = None,
    spread: float = np.inf,
    polish: float = 0.0,
    doubted: float = 0.0,
) -> tuple[Linearised, State] | None:
    """The run's own start state alone, everything else held: what a held-out run may be given.

    extra_noise (6, 6): see :func:`linearise_run`. spread: std of a prior on the start about
    ``start`` (m, rad; twice as much m/s, rad/s; INNER of it for what swings or yields within the rig).
    polish: see :func:`solve`. doubted: std, in tolerances, of what is believed of rig and devices
    (:class:`Doubts`).
    """
    bench = bench.of(run)
    p = bench.parameters.size
    model = model_at(bench.parameters, theta)

    def attempt(state: State) -> Linearised | None:
        return linearise_run(bench, run, theta, state, start_only=doubted == 0.0, extra_noise=extra_noise)

    current = attempt(start)
    if current is None:
        return None
    inner = model.states - layout.BODY_STATE
    damping, moved_so_far = 1e-9, np.zeros(current.jacobian.shape[1] - p)
    weight = _weight(moved_so_far.size, inner, spread)
    doubts = Doubts(p, doubted)
    for _ in range(iterations):
        information, gradient = doubts.eliminated(current)
        believed, inside, pull = _belief(bench, model, start)
        information = information + np.diag(weight) + inside
        gradient = gradient - weight * moved_so_far + pull
        damped = information + damping * np.diag(np.diag(information))
        change = np.linalg.lstsq(damped, gradient, rcond=1e-12)[0]
        if 0.5 * float(change @ gradient) < tolerance:
            break
        moved = on_cables(model, start.moved(start_basis(model, start) @ change))
        trial = attempt(moved)
        further = moved_so_far + change
        prior_change = 0.5 * float(weight @ (further**2 - moved_so_far**2))
        prior_change += _belief(bench, model, moved)[0] - believed
        if trial is not None and trial.jacobian.shape[1] - p != further.size:
            # Cables of which more than needed hold the body leave it other freedoms there: none is known of
            further, prior_change = np.zeros(trial.jacobian.shape[1] - p), 0.0
        cost = doubts.cost(current)
        if trial is not None and doubts.cost(trial) + prior_change < cost + 1e-9 * abs(cost):
            won = cost - doubts.cost(trial)
            current, start, moved_so_far, damping = trial, moved, further, max(damping * 0.1, 1e-12)
            weight = _weight(moved_so_far.size, inner, spread)
            left = 0.5 * float(current.residual @ current.residual - current.residual.size)
            if max(won, tolerance) < polish * left:
                break
        else:
            damping = max(damping, 1e-6) * 10.0
            if damping > 1e6:
                break
    return current, start


def _belief(bench: Bench, model: RigModel, start: State) -> tuple[float, Array | float, Array | float]:
    """Cost, information and negative gradient of what is believed of a swing that nothing measures."""
    if not bench.unseen:
        return 0.0, 0.0, 0.0
    return swing_belief(bench.rig, start, start_basis(model, start), bench.calm)


def _weight(size: int, inner: int, spread: float) -> Array:
    """(size,) prior information on a start, the ``inner`` last of it what swings or yields within the rig."""
    dof = (size - inner) // 2
    allowed = [1.0] * dof + [2.0] * dof + [INNER] * (inner // 2) + [INNER * INNER_RATE] * (inner // 2)
    return np.asarray((START_UNIT / (spread * np.array(allowed, dtype=float))) ** 2)
