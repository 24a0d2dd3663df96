"""What damps a watched body, in whole runs, and which of several such models is taken.

Each channel has its sensor's own noise here, for evidence compares fits to the same samples alone. One rule
holds for all of them, the ideal model among them: log evidence of the fitted runs, plus log predictive
density of the held-out ones, less what noise gains from so many effects among all that are asked. A model
that predicts the held-out runs worse than the ideal one does is none, whatever it makes of the fitted ones:
it bends a swing that nothing sees.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.solve import Evaluation, Problem, solve
from rig_identification.estimate.verdict import held_out_densities
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.hypotheses import needed_gain
from rig_identification.mismatch.swing_effects import Choice, exchanged, together
from rig_identification.mismatch.trial import Trial, log_evidence, may_be_none

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
        count = len(self.choice.others) + len(self.choice.holding)
        return log_evidence(self.evaluation) - sum(needed_gain(c, count) for c in self.choice.effects)

    @property
    def there(self) -> bool:
        """Whether no chosen effect may as well be none beside the others."""
        trials = (Trial(c, self.problem, self.evaluation, 0.0, True) for c in self.choice.effects)
        return bool(self.choice.effects) and not any(may_be_none(t) for t in trials)


#: What a model makes of the held-out runs.
Predicted = Callable[[Whole], Fitted]


def likeliest(models: Sequence[Whole], ideal: Fitted, predicted: Predicted) -> Whole | None:
    """The model for which all runs say most; None where that is the ideal one.

    ideal: the fit without any effect to the same runs. A held-out run that one of the models cannot follow
    tells nothing of the others, but a model that loses a run which the ideal one follows predicts worse.
    """
    plain = held_out_densities(ideal)
    held = [held_out_densities(predicted(m)) for m in models]
    asked = [
        (m, of) for m, of in zip(models, held, strict=True) if set(plain) <= set(of) and _no_worse(of, plain)
    ]
    if not asked:
        return None
    shared = set.intersection(*(set(of) for _, of in asked))
    said = [m.score + sum(of[key] for key in shared) for m, of in asked]
    best = int(np.argmax(said))
    # What the ideal model cannot follow at all says nothing for it
    before = log_evidence(ideal.evaluation) + sum(plain.get(key, 0.0) for key in shared & set(plain))
    after = asked[best][0].score + sum(asked[best][1][key] for key in shared & set(plain))
    return asked[best][0] if after > before else None


def _no_worse(densities: dict[tuple[str, float], float], plain: dict[tuple[str, float], float]) -> bool:
    """Whether the held-out runs that the ideal model follows are predicted at least as well as by it."""
    return sum(densities[key] for key in plain) >= sum(plain.values())


def chosen_anew(bare: Problem, model: Whole, budget: Budget) -> list[Whole]:
    """A model, and those that its own linearisation leads to, one after the other.

    bare: whole runs without any effect.
    """
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
        model = replace(model, choice=again, problem=problem, evaluation=evaluation, converged=converged)
        out.append(model)
    return out
