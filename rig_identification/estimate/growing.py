"""Horizons that grow: a fit that converges without a guess.

Sensitivity to the inertia grows with time, and the basin of a fit over a horizon T shrinks
as 1/T. So the first fraction of a second comes first, and each longer horizon starts from
the shorter one's result, whose remaining error is already far inside the next basin.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Bench, Linearised
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.solve import (
    PATIENCE,
    POLISH,
    Evaluation,
    Point,
    Problem,
    evaluate,
    excess,
    shortened,
    solve,
)
from rig_identification.estimate.start_state import fit_start
from rig_identification.model.motion import State

Array = NDArray[np.float64]

#: First horizon (s) and growth: about a period of such a rig, then fourfold.
FIRST_HORIZON = 2.0
GROWTH = 4.0
#: Share of the weak prior's std within which short horizons may move the body from its first guess.
HOLD = 0.1

#: Mean square residual of a short horizon above which the model may lack something.
HOPELESS_SQUARE = 2.0
#: Mean square residual below which what a fit lacks is so small that first order tells it.
NEAR_SQUARE = 1.3
#: Steps of the whole run's fit, and evaluations that each may take on average; fewer where a shorter horizon
#: was hopeless: they only say how far off it is.
STEPS, HOPELESS_STEPS = 20, 5
HOPELESS_PATIENCE = 1.0
#: Standard deviations of a sum of squares beyond which something is left of the residuals as a whole.
SEEN = 4.0


class OutOfReach(FloatingPointError):
    """A horizon beyond one that was fitted cannot be followed from where that fit ended."""

    def __init__(self, end: float, point: Point) -> None:
        super().__init__(f"the motion leaves every bound after the first {end:g} s")
        self.end, self.point = end, point


def misfit(evaluation: Evaluation) -> float:
    """Mean square of the whitened residuals; 1 where there are none."""
    residuals = np.concatenate([np.zeros(0), *(run.residual for run in evaluation.runs)])
    return float(np.mean(residuals**2)) if residuals.size else 1.0


def horizons(duration: float) -> list[float]:
    """Ends (s) of the growing horizons, the last one the whole run."""
    ends, end = [], FIRST_HORIZON
    while end * GROWTH**0.5 < duration:
        ends.append(end)
        end *= GROWTH
    return [*ends, duration]


def held_over(problem: Problem, end: float, center: Array) -> Problem:
    """The first ``end`` s of every run, with the body held near ``center`` (the body's part of a vector)."""
    return replace(
        shortened(problem, end), weak_center=center, weak=HOLD * problem.weak, stride=problem.stride / HOLD
    )


def _at(notify: Callable[[float, str], None], end: float, duration: float) -> Callable[[int, float], None]:
    """Progress of one horizon as progress of them all."""

    def step_done(step: int, cost: float) -> None:
        _ = cost
        notify(end / max(duration, 1e-9), f"first {end:.1f} s, step {step + 1}")

    return step_done


def solve_growing(
    problem: Problem, point: Point, notify: Callable[[float, str], None] | None = None
) -> tuple[Evaluation, bool]:
    """Fit over growing horizons; (evaluation over everything, whether the last one converged).

    Raises OutOfReach where a horizon after the first cannot be followed.
    """
    duration = max((run.grid.duration for run in problem.runs), default=0.0)
    ends = horizons(duration) if problem.runs else [0.0]
    guess = point.theta[:INERTIAL].copy()
    hopeless = False
    for i, end in enumerate(ends):
        whole = i == len(ends) - 1
        part = problem
        if not whole:
            # A short horizon must not throw away what the guess knows: the body stays near it
            part = held_over(problem, end, guess)
        # The start states alone first: their error is the largest, and everything else would bend to it
        point = replace(point, starts=settled_starts(part, point))
        if i and evaluate(part, point, residuals_only=True) is None:
            raise OutOfReach(ends[i - 1], point)
        # A short horizon needs no polish: the next one moves everything again
        evaluation, converged = solve(
            part,
            point,
            iterations=12 if not whole else HOPELESS_STEPS if hopeless else STEPS,
            # Bites only where much stays unexplained; a short hopeless horizon still says where to go
            polish=POLISH if whole or hopeless else 0.0,
            tolerance=1e-3 if whole else 0.5,
            patience=HOPELESS_PATIENCE if whole and hopeless else PATIENCE,
            notify=None if notify is None else _at(notify, end, duration),
        )
        if whole and not converged and misfit(evaluation) < HOPELESS_SQUARE:
            # So near the noise it is steps that lack: along a flat valley, or a short horizon was stuck
            evaluation, converged = solve(
                part, evaluation.point, iterations=STEPS, polish=POLISH, tolerance=1e-3
            )
        point = evaluation.point
        if misfit(evaluation) > HOPELESS_SQUARE:
            # What a few seconds cannot fit, the whole run hardly can: no valley is worth following far
            hopeless = True
    return evaluation, converged


def settled_starts(problem: Problem, point: Point) -> tuple[State, ...]:
    """Start states that fit best with everything else as it is at ``point``."""

    def settled(piece: tuple[Run, State]) -> State:
        run, start = piece
        found = fit_start(problem.bench, run, point.theta, start, tolerance=0.1, polish=POLISH)
        return start if found is None else found[1]

    return tuple(side_by_side(settled, zip(problem.runs, point.starts, strict=True)))


def fit_start_growing(bench: Bench, run: Run, theta: Array, start: State) -> tuple[Linearised, State] | None:
    """A held-out run's start state over growing horizons."""
    result = None
    for end in horizons(run.grid.duration):
        whole = end >= run.grid.duration
        result = fit_start(
            bench,
            run if whole else run.until(end),
            theta,
            start,
            tolerance=1e-3 if whole else 0.5,
            polish=POLISH,
        )
        if result is None:
            return None
        start = result[1]
    return result


def shows(evaluation: Evaluation) -> bool:
    """Whether the residuals as a whole show that something is left."""
    size = sum(run.residual.size for run in evaluation.runs)
    return bool(excess(evaluation) >= SEEN * np.sqrt(0.5 * size))
