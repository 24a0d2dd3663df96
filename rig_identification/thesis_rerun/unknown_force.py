"""Cases 3 and 4: the exciter's force is not measured, so it is estimated with its time history.

The force at its known mount is a random input with a wide white prior, held over each node
interval. The fit integrates it out (estimate/whitening.py); a smoother then says what it was,
the motion is linearised about that, and so on until the tensor stays. What is left to tell the
tensor is the moment about the line of the force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.prediction import exciter_wrench_map, smoothed
from rig_identification.estimate.solve import Point, solve
from rig_identification.model.body import tensor
from rig_identification.model.motion import on_cables
from rig_identification.thesis_rerun.motion import STEP, CaseMotion
from rig_identification.thesis_rerun.output_error import (
    nearest_body,
    noise_free_run,
    state_at,
    tensor_problem,
)

Array = NDArray[np.float64]

#: Prior of each component of the force over one node interval, N; rounds, and the change, a part, that ends them.
FORCE_STD = 500.0
ROUNDS, UNCHANGED = 8, 3e-4


@dataclass(frozen=True)
class UnknownForceFit:
    """Tensor and force that explain the recordings."""

    inertia: Array  # (3, 3) kg m^2
    converged: bool
    rounds: int
    time: Array  # (N,) s
    force: Array  # (N, 3) N, body axes, estimated
    true_force: Array  # (N, 3) N, body axes

    @property
    def force_rms(self) -> float:
        """N, of the force's error over all components."""
        return float(np.sqrt(np.mean((self.force - self.true_force) ** 2)))


def fit_with_unknown_force(motion: CaseMotion, window: tuple[float, float], guess: Array) -> UnknownForceFit:
    """Fit tensor and force to a window, s, from a first guess (3, 3) kg m^2."""
    run = replace(noise_free_run(motion, window, force=False), exciter=None, exciter_noise=0.0)
    problem, theta = tensor_problem(motion, (run,), nearest_body(guess))
    parameters = problem.bench.parameters
    spread = exciter_wrench_map(parameters, theta)
    problem = replace(problem, extra_noise=FORCE_STD**2 * spread @ spread.T)
    latent = np.zeros((run.grid.nodes, 6))
    point = Point(theta, (state_at(motion, window[0]),), (), (latent,))
    before, converged = np.full((3, 3), np.inf), False
    for rounds in range(1, ROUNDS + 1):  # noqa: B007
        evaluation, settled = solve(problem, point, iterations=4, tolerance=0.05)
        found = tensor(parameters.elements(evaluation.point.theta)[4:])
        _, wrench, _ = smoothed(evaluation.runs[0])
        latent = latent + wrench
        converged = settled and bool(np.max(np.abs(found - before)) < UNCHANGED * np.max(found))
        if converged:
            break
        before = found
        starts = tuple(on_cables(motion.model, s) for s in evaluation.point.starts)
        point = replace(evaluation.point, starts=starts, latents=(latent,))
    first = round(window[0] / STEP)
    force = np.linalg.lstsq(spread, latent.T, rcond=None)[0].T
    held = motion.held_force[first : first + run.grid.nodes]
    middle = np.concatenate([0.5 * (held[1:] + held[:-1]), held[-1:]])
    return UnknownForceFit(found, converged, rounds, STEP * np.arange(run.grid.nodes), force, middle)
