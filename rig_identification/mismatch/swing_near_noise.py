"""What damps a watched body, asked of whole runs where these come near the noise.

Pieces of a few swings tell that a swing dies away, and hardly by which law: each has a start of its own, and
where one turn is all that is measured also a swing beside it that nothing sees. Laws that fit pieces alike
part over a whole run, where the swing is wide at first and small at the end. One of the wrong kind then bends
the swing that nothing sees until the fitted runs are followed, and misses every other run.

So where whole runs come near the noise, and what is left is small, the laws that hardly trailed in pieces are
fitted to whole runs as well, and about each of these fits all effects are chosen from anew. Which of them is
taken, all runs say (swing_whole.py). Where one turn is all that is measured, pieces are not asked: what damps
the turn is too little within one, beside a start and a swing that nothing sees.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import (
    NEAR_SQUARE,
    misfit,
    settled_starts,
)
from rig_identification.estimate.identify import LEFT
from rig_identification.estimate.launch import launch_states
from rig_identification.estimate.observability import believed_point
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import (
    Evaluation,
    Point,
    Problem,
    as_good_as_settled,
    evaluate,
    solve,
)
from rig_identification.estimate.swing_period import long_enough
from rig_identification.estimate.unseen_swing import CALM
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.opened import extended
from rig_identification.mismatch.swing_effects import (
    DAMPERS,
    Choice,
    Notify,
    best_of_each_kind,
)
from rig_identification.mismatch.swing_whole import STEPS, Whole, chosen_anew
from rig_identification.mismatch.trial import Trial, log_evidence
from rig_identification.model.motion import State

#: Nats by which a law may trail the likeliest one in pieces and still be asked about whole runs.
CLOSE = 30.0
#: Entries of a body's vector by which it hangs askew.
ASKEW = slice(4, INERTIAL)
#: Amounts, in units of its prior's std, of which the likeliest is where the fit of a law of the turn begins.
AMOUNTS = tuple(float(a) for a in np.geomspace(1e-4, 1.0, 13))
#: Models of the turn alone that are fitted with all of it free, likeliest first, and steps of each fit.
FREED, FREED_STEPS = 2, 20


def near_noise_models(bare: Problem, first: Whole, rest: State, budget: Budget) -> list[Whole]:
    """Models of whole runs that may be likelier than what pieces chose; that one alone far from the noise.

    bare: whole runs without any effect. first: the choice of the pieces, wherever its fit stands. rest: how
    the body hangs.
    """
    if misfit(first.evaluation) >= NEAR_SQUARE or first.choice.holding:
        return [first]
    evaluation, converged = solve(first.problem, first.evaluation.point, iterations=STEPS, tolerance=0.1)
    first = replace(first, evaluation=evaluation, converged=converged)
    models = [first]
    for trial in _close(first.choice):
        if budget.spent():
            break
        at = believed_point(trial.problem, trial.evaluation)[:INERTIAL]
        parameters, pieces = trial.problem.bench.parameters, trial.evaluation.point.theta
        amounts = [pieces[parameters.index_of(p.name)] for p in trial.candidate.parameters]
        guesses = trial.evaluation.point.rest_guesses
        try:
            problem, point = _begun(bare, trial.candidate, at, amounts, rest, guesses)
            fitted = solve(problem, point, iterations=STEPS, tolerance=0.1)
        except (FloatingPointError, np.linalg.LinAlgError):
            continue
        models.append(Whole(replace(first.choice, chosen=(trial.candidate,)), problem, *fitted))
    return [m for model in models for m in chosen_anew(bare, model, budget) if m is first or m.there]


def _close(choice: Choice) -> list[Trial]:
    """Laws that hardly trail by themselves, and have no more amounts than what the pieces chose.

    A shape that the runs do not tell costs a law nothing: its interval stays the prior's.
    """
    amounts = sum(len(c.amounts) for c in choice.chosen)
    return [
        t
        for t in choice.alone
        if choice.alone[0].evidence - t.evidence < CLOSE
        and len(t.candidate.amounts) <= amounts
        and choice.chosen != (t.candidate,)
    ]


def models_of_one_turn(
    bare: Problem, ideal: Fitted, candidates: list[Candidate], notify: Notify, budget: Budget
) -> list[Whole]:
    """Models of whole runs of a body of which one turn is all that is measured.

    bare: whole runs without any effect, with the reference that effects need. ideal: their fit without any.
    Laws of damping are fitted one by one from the body as believed, which nothing has bent yet; about the
    likeliest of them all effects are chosen from anew. All that is the turn's alone (``_straight``): what
    damps, and how the turn softens, is found before the body may pass the turn on to a swing beside.
    """
    begun = ideal.guess or ideal.evaluation.point
    at = believed_point(ideal.problem, replace(ideal.evaluation, point=begun))[:INERTIAL]
    straight = _straight(bare, at)
    free = tuple(c for c in candidates if c.settle is None and _everywhere_alike(c))
    dampers = [c for c in free if c.effect in DAMPERS]
    plain = _at_believed(straight, at, ideal.rest, begun.rest_guesses)
    kinds = dampers if plain is None else best_of_each_kind(straight, plain, dampers)
    alone: list[tuple[Trial, bool]] = []
    for k, candidate in enumerate(kinds):
        if budget.spent():
            budget.leave(c.label for c in kinds[k:])
            break
        notify(f"search: {candidate.label}", 0.2)
        try:
            problem, point = _begun_straight(straight, candidate, at, ideal.rest, begun.rest_guesses)
            evaluation, converged = solve(problem, point, iterations=STEPS, tolerance=0.1)
        except (FloatingPointError, np.linalg.LinAlgError):
            continue
        alone.append((Trial(candidate, problem, evaluation, log_evidence(evaluation), True), converged))
    if not alone:
        return []
    alone.sort(key=lambda one: -one[0].evidence)
    first, converged = alone[0]
    choice = Choice((first.candidate,), (), free, tuple(t for t, _ in alone))
    notify("search: which effects together", 0.4)
    models = chosen_anew(straight, Whole(choice, first.problem, first.evaluation, converged), budget)
    models = sorted((m for m in models if m.there), key=lambda m: -m.score)
    notify("search: whole runs", 0.6)
    models = [_from_believed(m, at, ideal.rest, begun.rest_guesses) for m in models[:FREED]]
    return [f for m in models for f in _freed(bare, m)]


def _begun_straight(
    straight: Problem,
    candidate: Candidate,
    at: NDArray[np.float64],
    rest: State,
    guesses: tuple[State, ...],
) -> tuple[Problem, Point]:
    """The turn alone with one law, its amount the likeliest of AMOUNTS, each start as of the first swings."""
    problem = extended(straight, (candidate,))
    parameters = problem.bench.parameters
    theta = np.zeros(parameters.size)
    theta[:INERTIAL] = at
    point = _started(problem, theta, rest, guesses)
    amount = parameters.index_of(candidate.parameters[0].name)
    tried = []
    for value in AMOUNTS:
        some = theta.copy()
        some[amount] = value
        there = evaluate(problem, replace(point, theta=some), residuals_only=True)
        if there is not None:
            tried.append(there)
    return problem, min(tried, key=lambda e: e.cost).point if tried else point


def _started(problem: Problem, theta: NDArray[np.float64], rest: State, guesses: tuple[State, ...]) -> Point:
    """A point with the start of each run as its first swings have it.

    Starts that fit a whole run with too little damping are as wrong as that, and a fit stays in that valley.
    """
    first = replace(problem, runs=tuple(run.until(long_enough(run, 0.0)) for run in problem.runs))
    point = Point(theta, launch_states(problem.bench, problem.runs, theta, rest), guesses)
    return replace(point, starts=settled_starts(first, point))


def _from_believed(model: Whole, at: NDArray[np.float64], rest: State, guesses: tuple[State, ...]) -> Whole:
    """A model of the turn alone fitted from the body and the rig as believed, where that is likelier.

    Laws that were exchanged on the way have bent both; of their amounts little is left to find.
    """
    parameters = model.problem.bench.parameters
    theta = np.zeros(parameters.size)
    theta[:INERTIAL] = at
    for c in model.choice.effects:
        for p in c.parameters:
            i = parameters.index_of(p.name)
            theta[i] = model.evaluation.point.theta[i]
    try:
        point = _started(model.problem, theta, rest, guesses)
        evaluation, converged = solve(model.problem, point, iterations=STEPS, tolerance=0.1)
    except (FloatingPointError, np.linalg.LinAlgError):
        return model
    if log_evidence(evaluation) <= log_evidence(model.evaluation):
        return model
    return replace(model, evaluation=evaluation, converged=converged)


def _everywhere_alike(candidate: Candidate) -> bool:
    """Whether an effect is at no place, cable or end of its own.

    One turn tells how what damps it grows with the rate, and not where that acts.
    """
    placed = any(candidate.where.get(key) is not None for key in ("channel", "end"))
    return not placed and not any(".point." in p.name for p in candidate.parameters)


def _straight(problem: Problem, at: NDArray[np.float64]) -> Problem:
    """The problem with a body that hangs straight, with the axes of the body ``at``, and hardly swings.

    A body that hangs askew passes the turn on to the swing that nothing sees. Before the turn itself is
    right, a fit bends both to what it lacks, and stays in that valley.
    """
    weak = problem.weak.copy()
    weak[ASKEW] *= CALM
    bench = replace(problem.bench, calm=CALM)
    return replace(problem, bench=bench, weak=weak, weak_center=at.copy())


def _freed(bare: Problem, model: Whole) -> list[Whole]:
    """A model of the turn alone with the body and its swing as free as in ``bare``: as it stands, and fitted.

    To either side of a body that hangs straight what a fit gains may be next to nothing, and far away it may
    bend to noise. Which of both is likelier, all runs say.
    """
    bench = replace(model.problem.bench, calm=bare.bench.calm)
    problem = replace(model.problem, bench=bench, weak=bare.weak, weak_center=bare.weak_center)
    there = evaluate(problem, model.evaluation.point)
    if there is None:
        return []
    still = replace(
        model, problem=problem, evaluation=there, converged=as_good_as_settled(problem, there, LEFT)
    )
    try:
        evaluation, converged = solve(problem, there.point, iterations=FREED_STEPS)
    except (FloatingPointError, np.linalg.LinAlgError):
        return [still]
    converged = converged or as_good_as_settled(problem, evaluation, LEFT)
    return [still, replace(still, evaluation=evaluation, converged=converged)]


def _at_believed(
    bare: Problem, at: NDArray[np.float64], rest: State, guesses: tuple[State, ...]
) -> Evaluation | None:
    """Whole runs without any effect at the body ``at`` and the rig as described, each start at its best."""
    theta = np.zeros(bare.bench.parameters.size)
    theta[:INERTIAL] = at
    point = Point(theta, launch_states(bare.bench, bare.runs, theta, rest), guesses)
    return evaluate(bare, replace(point, starts=settled_starts(bare, point)))


def _begun(
    bare: Problem,
    candidate: Candidate,
    at: NDArray[np.float64],
    amounts: list[float],
    rest: State,
    guesses: tuple[State, ...],
) -> tuple[Problem, Point]:
    """Whole runs with one law of these ``amounts``, at the body ``at`` and the rig as described.

    Pieces bend a body, and a swing that nothing sees, to what they lack: a whole run that begins there stays
    in that valley.
    """
    problem = extended(bare, (candidate,))
    parameters = problem.bench.parameters
    theta = np.zeros(parameters.size)
    theta[:INERTIAL] = at
    for p, amount in zip(candidate.parameters, amounts, strict=True):
        theta[parameters.index_of(p.name)] = amount
    point = Point(theta, launch_states(problem.bench, problem.runs, theta, rest), guesses)
    return problem, replace(point, starts=settled_starts(problem, point))
