"""What of a session the model can follow from its first guess, and what it cannot.

A description may say of a rig what no rig is: cables too short for their hinges, a body that no cable holds
upright. The model then finds no pose at rest, or a motion that leaves every bound within two seconds. A fit
starts from what it can follow. What it cannot is left out of the fit and named; where nothing is left there
is no fit, and that is the answer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.growing import FIRST_HORIZON
from rig_identification.estimate.prediction import linearise_run, model_at
from rig_identification.estimate.rest_evidence import RestEvidence, linearise_rest, with_dummy
from rig_identification.estimate.solve import CannotBeFollowed, Point, Problem
from rig_identification.model.equilibrium import settle
from rig_identification.model.motion import State

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Followed:
    """A problem without what its model cannot follow, where its fit starts, and what is left out."""

    problem: Problem
    point: Point
    names: tuple[str, ...]  # recordings that are left out


def hanging(problem: Problem, theta: Array, rest: State) -> tuple[Problem, tuple[str, ...]]:
    """The problem with the static recordings alone in which its model hangs near ``rest``; the others."""
    kept, names = [], []
    for evidence in problem.rests:
        if rest_near(problem, evidence, theta, rest) is None:
            names.append(evidence.recording.name)
        else:
            kept.append(evidence)
    return replace(problem, rests=tuple(kept)), tuple(names)


def followable(problem: Problem, point: Point, rest: State) -> Followed:
    """The problem and its point with the runs and rests alone that the model follows there.

    Of each run the first horizon of the fit, from its start state and, where that fails, from ``rest``.
    Raises CannotBeFollowed where nothing is left.
    """
    runs, starts, rests, guesses, names = [], [], [], [], []
    for run, start in zip(problem.runs, point.starts, strict=True):
        found = _start_of(problem, run, point.theta, (start, rest))
        if found is None:
            names.append(run.recording.name)
        else:
            runs.append(run)
            starts.append(found)
    for evidence, guess in zip(problem.rests, point.rest_guesses, strict=True):
        pose = rest_near(problem, evidence, point.theta, guess)
        if pose is None:
            names.append(evidence.recording.name)
        else:
            rests.append(evidence)
            guesses.append(pose)
    if not (runs or rests):
        raise CannotBeFollowed(problem, point.theta, tuple(names))
    kept = replace(problem, runs=tuple(runs), rests=tuple(rests))
    starting = Point(point.theta, tuple(starts), tuple(guesses))
    return Followed(kept, starting, tuple(dict.fromkeys(names)))


def _start_of(problem: Problem, run: Run, theta: Array, states: tuple[State, ...]) -> State | None:
    """The first of the ``states`` from which the model follows the run's first horizon; None: of none."""
    first = run.until(FIRST_HORIZON)
    for state in states:
        if state.is_finite and linearise_run(problem.bench, first, theta, state) is not None:
            return state
    return None


def rest_near(problem: Problem, evidence: RestEvidence, theta: Array, guess: State) -> State | None:
    """Near where the body hangs in a static recording; None where the model finds no rest."""
    if not guess.is_finite:
        return None
    if linearise_rest(problem.bench, evidence, theta, guess) is not None:
        return guess
    fallen = settle(with_dummy(model_at(problem.bench.parameters, theta), evidence.dummy), guess)
    if not fallen.is_finite or linearise_rest(problem.bench, evidence, theta, fallen) is None:
        return None
    return fallen
