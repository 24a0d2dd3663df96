"""What damps a watched body, asked of whole runs where these come near the noise.

Pieces of a few swings tell that a swing dies away, and hardly by which law: each has a start of its own, and
where one turn is all that is measured also a swing beside it that nothing sees. Laws that fit pieces alike
part over a whole run, where the swing is wide at first and small at the end. One of the wrong kind then bends
the swing that nothing sees until the fitted runs are followed, and misses every other run.

So where whole runs come near the noise, and what is left is small, the laws that hardly trailed in pieces are
fitted to whole runs as well, and about each of these fits all effects are chosen from anew. Of those that the
fitted runs hardly tell apart the one is taken for which all runs say most, held-out ones among them, as of
close rivals elsewhere (search/whole.py). Each channel has its sensor's own noise there, for evidence compares
fits to the same samples alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import NEAR_SQUARE, misfit, settled_starts
from rig_identification.estimate.launch import launch_states
from rig_identification.estimate.observability import believed_point
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Point, Problem, solve
from rig_identification.estimate.verdict import held_out_densities
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.hypotheses import needed_gain
from rig_identification.mismatch.screen import extended
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
    predicted: Callable[[Whole], Fitted],
    budget: Budget,
) -> Whole | None:
    """The likeliest model of all runs; None where ``first`` is, or leaves more than noise.

    bare: whole runs without any effect. first: the choice of the pieces, wherever its fit stands. rest: how
    the body hangs. predicted: what a model makes of the held-out runs.
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
            models.append(_fitted(bare, first.choice, trial, rest))
        except (FloatingPointError, np.linalg.LinAlgError):
            continue
    found = [m for model in models for m in _chosen_anew(bare, model, budget) if m is first or m.there]
    best = _for_which_all_runs_say_most(found, predicted)
    return None if best.choice.labels == first.choice.labels else best


def _for_which_all_runs_say_most(models: list[Whole], predicted: Callable[[Whole], Fitted]) -> Whole:
    """Of the models that the fitted runs hardly tell apart the one that predicts the held-out runs likeliest.

    A run that one of them cannot follow tells nothing of the others.
    """
    highest = max(m.score for m in models)
    close: dict[tuple[str, ...], Whole] = {}
    for m in sorted(models, key=lambda m: -m.score):
        if highest - m.score < CLOSE:
            close.setdefault(m.choice.labels, m)
    rivals = list(close.values())
    if len(rivals) == 1:
        return rivals[0]
    held = [held_out_densities(predicted(m)) for m in rivals]
    followed = set.intersection(*(set(densities) for densities in held))
    said = [m.score + sum(of[key] for key in followed) for m, of in zip(rivals, held, strict=True)]
    return rivals[int(np.argmax(said))]


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


def _fitted(bare: Problem, choice: Choice, trial: Trial, rest: State) -> Whole:
    """Whole runs with one law, begun at its amount in pieces and at the body and the rig as believed.

    Pieces bend a body, and a swing that nothing sees, to what they lack: a whole run that begins there stays
    in that valley.
    """
    problem = extended(bare, (trial.candidate,))
    parameters, pieces = problem.bench.parameters, trial.evaluation.point.theta
    theta = np.zeros(parameters.size)
    theta[:INERTIAL] = believed_point(trial.problem, trial.evaluation)[:INERTIAL]
    for p in trial.candidate.parameters:
        theta[parameters.index_of(p.name)] = pieces[trial.problem.bench.parameters.index_of(p.name)]
    starts = launch_states(problem.bench, problem.runs, theta, rest)
    begun = Point(theta, starts, trial.evaluation.point.rest_guesses)
    begun = replace(begun, starts=settled_starts(problem, begun))
    evaluation, converged = solve(problem, begun, iterations=STEPS, tolerance=0.1)
    return Whole(replace(choice, chosen=(trial.candidate,)), problem, evaluation, converged)


def _chosen_anew(bare: Problem, model: Whole, budget: Budget) -> list[Whole]:
    """A model, and those that its own linearisation leads to, one after the other."""
    out, seen = [model], {model.choice.labels}
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
        out.append(model)
    return out
