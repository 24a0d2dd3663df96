"""Whole runs from a fit to their pieces: fitted, and predicted where they are held out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.follow import followed
from rig_identification.estimate.growing import fit_start_growing
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.prediction import Linearised, model_at
from rig_identification.estimate.solve import POLISH, Evaluation, Point, Problem, solve
from rig_identification.model.equilibrium import find_rest
from rig_identification.model.motion import State

#: Steps of a fit of whole runs: short pieces may leave a body far along a flat valley.
STEPS = 40
#: Rounds of following what happened and fitting about it.
FOLLOWED = 4


def fit_whole(
    ideal: Fitted,
    whole: Problem,
    parts: Problem,
    point: Point,
    stop: Callable[[], bool] | None = None,
    curved: bool = False,
    steps: int = STEPS,
) -> Fitted:
    """Fit ``whole`` from a ``point`` of the same model's fit to its ``parts``; predict the held-out runs.

    stop: whether to end unconverged. curved: whether the motion may answer so sharply to its noise that the
    undisturbed one is not what happened. steps: at most.
    """
    guess = (*point.rest_guesses, *point.starts)[0]
    rest = find_rest(model_at(whole.bench.parameters, point.theta), guess).state
    begun = {run.begins: state for run, state in zip(parts.runs, point.starts, strict=True)}
    starts = tuple(
        begun.get(run.begins) or launch_state(whole.bench, run, point.theta, rest) for run in whole.runs
    )
    begin = Point(point.theta, starts, point.rest_guesses)
    found = _about_what_happened(whole, begin, stop, steps) if curved else None
    evaluation, converged = found or solve(whole, begin, iterations=steps, polish=POLISH, stop=stop)
    known = (*ideal.holdout_runs, *ideal.lost)
    held_runs, held, lost = predicted(whole, known, evaluation.point.theta, rest)
    return replace(
        ideal,
        problem=whole,
        evaluation=evaluation,
        converged=converged,
        holdout_runs=held_runs,
        holdouts=held,
        lost=lost,
    )


def _about_what_happened(
    whole: Problem, begin: Point, stop: Callable[[], bool] | None, steps: int
) -> tuple[Evaluation, bool] | None:
    """A fit about what happened, followed anew until nothing changes; None where it cannot be followed."""
    point, found = begin, None
    for _ in range(FOLLOWED):
        there = followed(whole, point)
        if there is None:
            break
        found = solve(whole, there, iterations=steps, stop=stop)
        point = found[0].point
        if found[1] or (stop is not None and stop()):
            break
    return found


def predicted(
    problem: Problem, held: tuple[Run, ...], theta: NDArray[np.float64], rest: State
) -> tuple[tuple[Run, ...], tuple[Linearised, ...], tuple[Run, ...]]:
    """Held-out runs that can be followed from a start state of their own, how they come out; the others."""
    outcomes, lost = [], []
    for run in held:
        state = launch_state(problem.bench, run, theta, rest)
        result = fit_start_growing(problem.bench, run, theta, state)
        if result is None:
            lost.append(run)
        else:
            outcomes.append((run, result[0]))
    return (
        tuple(run for run, _ in outcomes),
        tuple(linearised for _, linearised in outcomes),
        tuple(lost),
    )
