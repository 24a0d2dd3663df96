"""Which effects are in a body that is only watched to swing.

One hypothesis at a time first, and then all subsets at once about each fit (subsets.py), in pieces of
several periods with every channel weighed by what its residual really has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.cautious import coherence, reweighted
from rig_identification.estimate.launch import launch_states
from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.rolling import ways_of_rolling, with_body
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate, solve
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.hypotheses import needed_gain
from rig_identification.mismatch.opened import carried, extended, free_without
from rig_identification.mismatch.subsets import best_subset, gains_alone
from rig_identification.mismatch.trial import Trial, finished, log_evidence

Notify = Callable[[str, float], None]

#: Effects that change how a swing dies away.
DAMPERS = ("hinge_damping", "hinge_friction", "air_drag")
#: Steps of the fit of one hypothesis.
STEPS = 8
#: Where a hypothesis starts, in units of its prior's std.
FIRST_VALUE = 0.02
#: Part of the likeliest effect's gain that another one makes, to first order, before it is fitted, and by its
#: fit before the body's rolling is asked beside it.
COMPARABLE = 0.5
#: Share of each piece that is looked at for how the body rolls, its beginning: a roll is faster than a swing.
SHOWN = 0.5
#: Times that the choice of effects is made anew about the fit of the one before.
ROUNDS = 5


def _alike_everywhere(one: Candidate, other: Candidate) -> bool:
    """Whether ``one`` is the same effect as ``other``, everywhere alike where that is at a place of its own.

    Two laws of one thing, of which together the first makes what the second lacks: air that acts on the
    centre of mass alone, and on the body's sides.
    """
    placed = [any(v is not None for v in c.where.values()) for c in (one, other)]
    return one.effect == other.effect and placed == [False, True]


def _trial(problem: Problem, evaluation: Evaluation, candidate: Candidate) -> Trial | None:
    wide = extended(problem, (candidate,))
    point = carried(wide, problem, evaluation.point)
    theta = point.theta.copy()
    theta[wide.bench.parameters.index_of(candidate.parameters[0].name)] = FIRST_VALUE
    point, steps = replace(point, theta=theta), STEPS
    if candidate.settle is not None:
        # From another body: the way to its best is longer
        point, steps = candidate.settle(wide, point, evaluation), 3 * STEPS
    return _fitted(candidate, wide, point, steps)


def _fitted(candidate: Candidate, problem: Problem, point: Point, steps: int) -> Trial | None:
    """A hypothesis fitted from a point of its problem; None where it cannot be followed."""
    try:
        fitted, _ = solve(problem, point, iterations=steps, tolerance=0.5)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None
    return finished(Trial(candidate, problem, fitted, log_evidence(fitted), True))


def _ways_of(trial: Trial) -> list[NDArray[np.float64]]:
    """Bodies that roll as the pieces may show with a trial's effect in the model."""
    problem, point = trial.problem, trial.evaluation.point
    first = tuple(run.until(SHOWN * run.grid.duration) for run in problem.runs)
    return ways_of_rolling(problem, first, point.theta, point.starts[0])


def _rolling_otherwise(trial: Trial, ways: list[NDArray[np.float64]], budget: Budget) -> Trial:
    """The trial with its body rolling in one of several ways, where that is likelier."""
    if budget.spent() or not ways:
        return trial
    begun = [otherwise for otherwise in (_begun(trial, way) for way in ways) if otherwise is not None]
    if not begun:
        return trial
    # Within a few steps each is in its own valley: the way to the bottom is worth going in the likeliest one
    likeliest = max(begun, key=log_evidence)
    again = _fitted(trial.candidate, trial.problem, likeliest.point, 2 * STEPS)
    return trial if again is None or again.evidence <= trial.evidence else again


def _begun(trial: Trial, way: NDArray[np.float64]) -> Evaluation | None:
    """First steps of the trial with its body rolling in another ``way``; None where it cannot be followed."""
    problem, point = trial.problem, trial.evaluation.point
    theta = with_body(problem.bench.parameters, point.theta, way)
    starts = launch_states(problem.bench, problem.runs, theta, point.starts[0])
    try:
        start = replace(point, theta=theta, starts=starts)
        return solve(problem, start, iterations=STEPS // 2, tolerance=0.5)[0]
    except (FloatingPointError, np.linalg.LinAlgError):
        return None


def _weighed(raw: Problem, problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation]:
    """The model of ``problem`` on the pieces of ``raw``, each channel weighed by what it leaves now, fitted.

    raw: pieces with the sensors' own noise. Weights that an earlier, poorer model set would hide from a
    better one what it still leaves.
    """
    bare = replace(problem, runs=raw.runs)
    now = evaluate(bare, evaluation.point)
    if now is None:
        return problem, evaluation
    heavy = reweighted(bare, now)
    return heavy, solve(heavy, evaluation.point, iterations=STEPS, tolerance=0.5)[0]


def _better(
    problem: Problem,
    evaluation: Evaluation,
    left: list[Candidate],
    count: int,
    notify: Callable[[str], None],
    budget: Budget,
) -> list[Trial]:
    """Trials that gain more than chance over ``count`` does, likeliest first; past ``budget`` none begins."""
    base, tried = log_evidence(evaluation), []
    for k, candidate in enumerate(left):
        if budget.spent():
            budget.leave(c.label for c in left[k:])
            break
        notify(f"search: {candidate.label}")
        trial = _trial(problem, evaluation, candidate)
        if trial is not None and trial.evidence - base > needed_gain(candidate, count):
            tried.append(trial)
    return sorted(tried, key=lambda t: -t.evidence)


@dataclass(frozen=True)
class Choice:
    """Which effects are in the model of a watched body."""

    chosen: tuple[Candidate, ...]
    holding: tuple[Candidate, ...]  # what changes the body's freedom: stays
    others: tuple[Candidate, ...]  # all that are chosen from
    alone: tuple[Trial, ...]  # what damps, each by itself, likeliest first

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the chosen effects' first parameters."""
        return tuple(c.parameters[0].name for c in self.chosen)

    @property
    def effects(self) -> tuple[Candidate, ...]:
        """All that is in the model."""
        return (*self.chosen, *self.holding)

    @property
    def rivals(self) -> tuple[dict[str, object], ...]:
        """What by itself would damp less well than the likeliest does, and is not in the model."""
        return tuple(
            rival(t, self.alone[0].evidence - t.evidence)
            for t in self.alone[1:]
            if t.candidate not in self.chosen
        )


def _comparable(tried: list[Trial], base: float) -> list[Trial]:
    """The trials that gain a part of what the likeliest of all does."""
    enough = COMPARABLE * (tried[0].evidence - base)
    return [trial for trial in tried if trial.evidence - base > enough]


def damped(
    raw: Problem,
    base: Problem,
    evaluation: Evaluation,
    candidates: list[Candidate],
    notify: Notify,
    budget: Budget,
) -> tuple[Choice, Problem, Evaluation] | None:
    """The effects that belong into the model together, and its fit to pieces; None: nothing damps.

    What damps most comes first, for no swing is followed without it, with the body rolling as suits it;
    then what changes the body's freedom, which is no matter of degree. Beside that all others are chosen
    anew, until the choice stays. Past the ``budget`` nothing new is begun.
    """
    dampers = [c for c in candidates if c.effect in DAMPERS]
    holds = [c for c in candidates if c.settle is not None]
    count = len(candidates)

    def told(share: float) -> Callable[[str], None]:
        return lambda stage: notify(stage, share)

    kinds = best_of_each_kind(base, evaluation, dampers)
    tried = _better(base, evaluation, kinds, count, told(0.2), budget)
    if not tried:
        return None
    notify("search: how it rolls", 0.3)
    # Fitted to a body that rolls as it does not, what stops a swing is bent to next to nothing
    # At which frequency it rolls does not depend on what damps it
    ways = [] if budget.spent() else _ways_of(tried[0])
    near = _comparable(tried, log_evidence(evaluation))
    first = max((_rolling_otherwise(trial, ways, budget) for trial in near), key=lambda t: t.evidence)
    held = _better(first.problem, first.evaluation, holds, count, told(0.35), budget)
    others = tuple(c for c in candidates if c not in holds)
    choice = Choice((first.candidate,), (), others, tuple(tried))
    free = _settled(raw, base, first, choice, told(0.4), budget)
    if not held:
        return free
    # What changes the body's freedom may have stood in for what was not in the model yet
    choice = replace(choice, holding=(held[0].candidate,))
    bound = _settled(raw, base, held[0], choice, told(0.5), budget)
    fair = replace(free[1], runs=bound[1].runs)
    fitted, _ = solve(fair, free[2].point, iterations=STEPS, tolerance=0.5)
    # What follows the motion counts as one error, not as many small ones
    gain = (log_evidence(bound[2]) - log_evidence(fitted)) / coherence(*bound[1:])
    return bound if gain > needed_gain(held[0].candidate, count) else free


def _settled(
    raw: Problem, base: Problem, now: Trial, choice: Choice, notify: Callable[[str], None], budget: Budget
) -> tuple[Choice, Problem, Evaluation]:
    """Effects chosen anew about each fit until the choice stays or returns. now: the fit of the first."""
    problem, evaluation = _weighed(raw, now.problem, now.evaluation)
    seen = {choice.labels}
    for _ in range(ROUNDS):
        if budget.spent():
            break
        notify("search: which effects together")
        again = together(base, problem, evaluation, choice)
        if again.labels in seen:
            break
        seen.add(again.labels)
        changed, fitted = exchanged(base, problem, evaluation, choice, again)
        choice = again
        problem, evaluation = _weighed(raw, changed, fitted)
    return choice, problem, evaluation


def exchanged(
    base: Problem, problem: Problem, evaluation: Evaluation, before: Choice, after: Choice
) -> tuple[Problem, Evaluation]:
    """A fit with one choice made one with another. base: without any effect."""
    changed = extended(replace(base, runs=problem.runs), after.effects)
    point = carried(changed, problem, evaluation.point)
    theta = point.theta.copy()
    for candidate in after.chosen:
        if candidate not in before.chosen:
            theta[changed.bench.parameters.index_of(candidate.parameters[0].name)] = FIRST_VALUE
    fitted, _ = solve(changed, replace(point, theta=theta), iterations=STEPS, tolerance=0.5)
    return changed, fitted


@dataclass(frozen=True)
class _AllAtOnce:
    """What one linearisation with all candidates free says of them (subsets.py)."""

    best: NDArray[np.float64]
    covariance: NDArray[np.float64]
    groups: list[list[int]]
    positive: list[bool]


def _all_at_once(
    base: Problem,
    problem: Problem,
    evaluation: Evaluation,
    holding: tuple[Candidate, ...],
    candidates: tuple[Candidate, ...],
) -> _AllAtOnce | None:
    """All ``candidates`` free about a fit, beside what is ``holding``; None where it cannot be followed.

    base: without any effect; problem, evaluation: the fit, with some of them perhaps.
    """
    wide = extended(replace(base, runs=problem.runs), (*holding, *candidates))
    point = carried(wide, problem, evaluation.point)
    full = evaluate(wide, point)
    if full is None:
        return None
    parameters = wide.bench.parameters
    groups = [[parameters.index_of(p.name) for p in c.parameters] for c in candidates]
    mine = sorted({i for group in groups for i in group})
    rest = free_without(wide, point, full, {p.name for c in candidates for p in c.parameters}, 0)
    index = np.concatenate([rest, np.array(mine, dtype=rest.dtype)])
    covariance = invert_information(full.information[np.ix_(index, index)])
    best = point.theta[mine] + (covariance @ full.gradient[index])[rest.size :]
    return _AllAtOnce(
        best,
        covariance[rest.size :, rest.size :],
        [[mine.index(i) for i in group] for group in groups],
        [c.positive > 0 for c in candidates],
    )


def best_of_each_kind(base: Problem, evaluation: Evaluation, dampers: list[Candidate]) -> list[Candidate]:
    """Of each effect the candidate that gains most to first order, where that comes near the best of all.

    base, evaluation: a fit without any effect.
    """
    found = _all_at_once(base, base, evaluation, (), tuple(dampers))
    if found is None:
        return dampers
    gains = gains_alone(found.best, found.covariance, found.groups, found.positive)
    order = sorted(range(len(dampers)), key=lambda k: -gains[k])
    best: dict[str, Candidate] = {}
    for k in order:
        if gains[k] > COMPARABLE * gains[order[0]]:
            best.setdefault(dampers[k].effect, dampers[k])
    return list(best.values())


def together(base: Problem, problem: Problem, evaluation: Evaluation, choice: Choice) -> Choice:
    """Which effects belong into the model, by what all at once promise about a fit with some (subsets.py).

    base: without any effect; problem, evaluation: the fit with those of ``choice``.
    """
    candidates = choice.others
    found = _all_at_once(base, problem, evaluation, choice.holding, candidates)
    if found is None:
        return choice
    kept = best_subset(
        found.best,
        found.covariance,
        found.groups,
        found.positive,
        [needed_gain(c, len(candidates)) for c in candidates],
        [
            (i, k)
            for i, a in enumerate(candidates)
            for k, b in enumerate(candidates)
            if _alike_everywhere(a, b)
        ],
    )
    return replace(choice, chosen=tuple(candidates[k] for k in kept))
