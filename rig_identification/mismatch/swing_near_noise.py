"""What damps a watched body, asked of whole runs where these come near the noise.

Pieces of a few swings tell that a swing dies away, and hardly by which law: each has a start of its own, and
where one turn is all that is measured also a swing beside it that nothing sees. Laws that fit pieces alike
part over a whole run, where the swing is wide at first and small at the end. One of the wrong kind then bends
the swing that nothing sees until the fitted runs are followed, and misses every other run.

So where whole runs come near the noise, and what is left is small, the laws that hardly trailed in pieces are
fitted to whole runs as well, and about each of these fits all effects are chosen from anew. The likeliest of
all is taken. Each channel has its sensor's own noise there: evidence compares fits to the same samples alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.growing import NEAR_SQUARE, misfit, settled_starts
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.solve import Evaluation, Point, Problem, solve
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.hypotheses import needed_gain
from rig_identification.mismatch.swing_effects import Choice, exchanged, together
from rig_identification.mismatch.trial import Trial, log_evidence, may_be_none
from rig_identification.model.motion import State

#: Nats by which a law may trail the likeliest one in pieces and still be asked about whole runs.
CLOSE = 30.0
#: Steps of a fit of whole runs, and times that effects are chosen anew about one.
STEPS, ROUNDS = 20, 3


@dataclass(frozen=True)
class Whole:
    """A choice of effects fitted to whole runs, each channel with its sensor's noise."""

    choice: Choice
    problem: Problem
    evaluation: Evaluation
    converged: bool

    @property
    def score(self) -> float:
        """Log evidence, less what noise gains from so many effects among all that are asked."""
        count = len(self.choice.others)
        return log_evidence(self.evaluation) - sum(needed_gain(c, count) for c in self.choice.chosen)

    @property
    def there(self) -> bool:
        """Whether no chosen effect may as well be none beside the others."""
        trials = (Trial(c, self.problem, self.evaluation, 0.0, True) for c in self.choice.effects)
        return bool(self.choice.effects) and not any(may_be_none(t) for t in trials)


def likeliest_near_noise(
    bare: Problem,
    first: Whole,
    rest: State,
    refined: Callable[[Trial], tuple[Problem, Evaluation]],
    budget: Budget,
) -> Whole | None:
    """The likeliest model of the whole runs; None where ``first`` is, or leaves more than noise.

    bare: whole runs without any effect. first: the choice of the pieces, wherever its fit stands. rest: how
    the body hangs. refined: the cautious fit of one law in pieces, from which its fit to whole runs starts.
    """
    if misfit(first.evaluation) >= NEAR_SQUARE or first.choice.holding:
        return None
    evaluation, converged = solve(first.problem, first.evaluation.point, iterations=STEPS, tolerance=0.1)
    first = replace(first, evaluation=evaluation, converged=converged)
    models = [first]
    for trial in _close(first.choice):
        if budget.spent():
            break
        try:
            weights, evaluation = refined(trial)
            models.append(_fitted(bare, _alone(first.choice, trial), weights, evaluation.point, rest))
        except (FloatingPointError, np.linalg.LinAlgError):
            continue
    found = [_chosen_anew(bare, model, budget) for model in models]
    best = max((m for m in (first, *found) if m is first or m.there), key=lambda m: m.score)
    return None if best.choice.labels == first.choice.labels else best


def _close(choice: Choice) -> list[Trial]:
    """Laws that hardly trail by themselves, and have no more numbers than what the pieces chose."""
    numbers = sum(len(c.parameters) for c in choice.chosen)
    return [
        t
        for t in choice.alone
        if choice.alone[0].evidence - t.evidence < CLOSE
        and len(t.candidate.parameters) <= numbers
        and choice.chosen != (t.candidate,)
    ]


def _alone(choice: Choice, trial: Trial) -> Choice:
    return replace(choice, chosen=(trial.candidate,))


def _fitted(bare: Problem, choice: Choice, weights: Problem, point: Point, rest: State) -> Whole:
    """Whole runs with a choice of effects. weights, point: the same in pieces, from which the fit starts."""
    problem = replace(bare, bench=weights.bench, weak_center=weights.weak_center)
    starts = tuple(launch_state(problem.bench, run, point.theta, rest) for run in problem.runs)
    begun = Point(point.theta, starts, point.rest_guesses)
    begun = replace(begun, starts=settled_starts(problem, begun))
    evaluation, converged = solve(problem, begun, iterations=STEPS, tolerance=0.1)
    return Whole(choice, problem, evaluation, converged)


def _chosen_anew(bare: Problem, model: Whole, budget: Budget) -> Whole:
    """The likeliest of a model and of those that its own linearisation leads to, one after the other."""
    best, seen = model, {model.choice.labels}
    for _ in range(ROUNDS):
        if budget.spent():
            break
        again = together(bare, model.problem, model.evaluation, model.choice)
        if again.labels in seen or not again.chosen:
            break
        seen.add(again.labels)
        try:
            problem, evaluation = exchanged(bare, model.problem, model.evaluation, model.choice, again)
            evaluation, converged = solve(problem, evaluation.point, iterations=STEPS, tolerance=0.1)
        except (FloatingPointError, np.linalg.LinAlgError):
            break
        model = Whole(again, problem, evaluation, converged)
        best = max(best, model, key=lambda m: m.score)
    return best
