"""The motion that the recordings tell, with a discrepancy's wrench in the model: relinearised until it stays.

An iterated Kalman smoother (Bell, SIAM J. Optim. 4, 1994): the motion is integrated with the wrench as
smoothed so far, linearised about that, and smoothed again, which is Gauss and Newton's method on the wrench's
course. Over a long run the first linearisation is about a motion far out of step. The wrench is therefore
found over a short beginning first, and that is doubled.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.prediction import Linearised, drive, model_at, smoothed, start_basis
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, shortened
from rig_identification.model.inverse import kept_in_motion
from rig_identification.model.motion import RigModel, State, on_cables

Array = NDArray[np.float64]

#: Length (s) of the first beginning of a run, over which no rig's swing gets out of step.
FIRST = 0.5
#: How many times the wrench is smoothed again at most, and the change of the cost (nats) at which it stays.
ROUNDS, STAYS = 5, 1.0
#: Std of a start state about where it stands, m and rad, m/s and rad/s.
PLACE, SPEED = 0.05, 0.2


def followed(problem: Problem, point: Point) -> Point | None:
    """The point with each run's wrench and start as its recordings tell them; None where none can be told.

    The problem has a discrepancy.
    """
    there = evaluate(problem, point, residuals_only=True)
    return None if there is None else _smoothed(problem, there)


def _smoothed(problem: Problem, there: Evaluation) -> Point:
    models = (model_at(problem.bench.of(run).parameters, there.point.theta) for run in problem.runs)
    pairs = [_of_run(*own) for own in zip(models, there.point.starts, there.runs, strict=True)]
    return replace(there.point, starts=tuple(s for s, _ in pairs), latents=tuple(w for _, w in pairs))


def _of_run(model: RigModel, start: State, run: Linearised) -> tuple[State, Array]:
    """Start state and (N, 6) wrench of a run."""
    basis = start_basis(model, start)
    basis = basis / np.linalg.norm(basis, axis=0)
    spread = basis * np.repeat([PLACE, SPEED], basis.shape[1] // 2)
    states, wrench, _ = smoothed(run, spread @ spread.T)
    return on_cables(model, start.moved(states[0])), run.latent + wrench


def found_from(problem: Problem, point: Point) -> Point | None:
    """The point with wrenches and starts of whole runs, found over beginnings of doubled length."""
    whole = max(run.grid.duration for run in problem.runs)
    end = FIRST
    while True:
        part = problem if end >= whole else shortened(problem, end)
        found = _until_it_stays(part, replace(point, latents=_carried_on(part, point)))
        if found is None or end >= whole:
            return found
        point, end = found, 2.0 * end


def beside(problem: Problem, point: Point, wide: Problem, there: Evaluation) -> Point:
    """The ``point`` of a ``wide`` problem with the wrenches under which its model moves as ``there``.

    problem: of ``there``. An effect that enters with all of its amount acts beside wrenches that stood in for
    it; without this the motion is lost within seconds.
    """
    latents = []
    for run, linearised in zip(problem.runs, there.runs, strict=True):
        parameters = problem.bench.of(run).parameters
        old = model_at(parameters, there.point.theta)
        new = model_at(wide.bench.of(run).parameters, point.theta)
        driven = drive(run, parameters, there.point.theta)
        driven = replace(driven, wrench=driven.wrench + linearised.latent)
        latents.append(kept_in_motion(old, linearised.motion, driven, new))
    return replace(point, latents=tuple(latents))


def _until_it_stays(part: Problem, point: Point) -> Point | None:
    last = np.inf
    for _ in range(ROUNDS):
        there = evaluate(part, point, residuals_only=True)
        if there is None:
            return None
        if abs(there.cost - last) < STAYS:
            break
        last, point = there.cost, _smoothed(part, there)
    return point


def _carried_on(part: Problem, point: Point) -> tuple[Array, ...]:
    """(N, 6) wrench of each run: as known, and forgotten after."""
    out = []
    for k, run in enumerate(part.runs):
        wrench = np.zeros((run.grid.nodes, 6))
        known = point.latents[k] if point.latents else None
        if known is not None and known.size:
            size = min(wrench.shape[0], known.shape[0])
            wrench[:size] = known[:size]
            if part.discrepancy is not None:
                later = run.grid.step * np.arange(1, wrench.shape[0] - size + 1)
                wrench[size:] = known[size - 1] * np.exp(-later / part.discrepancy.correlation)[:, None]
        out.append(wrench)
    return tuple(out)
