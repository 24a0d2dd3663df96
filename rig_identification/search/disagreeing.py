"""What runs that disagree lack: each of them is noise by itself, with other parameters than the other one's.

A model that lacks a little may bend its parameters until the fitted runs are noise. A held-out run then asks
for others (constancy.py), and nothing that fitted runs show says what for: what was left out shows in that
they cannot all be right. So hypotheses are screened and fitted about all runs together. What they choose is
fitted to the fitted runs alone, and told only where the held-out ones agree with that: they choose among
hypotheses, of which there are a few hundred, and fit no number of any.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import shows
from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.solve import solve
from rig_identification.estimate.verdict import hear
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.pulse import all_runs
from rig_identification.mismatch.whole_runs import Named, whole_runs
from rig_identification.search.expand import Standing, children
from rig_identification.search.ladder import Rung
from rig_identification.search.laws import in_words, sparse
from rig_identification.search.levels import ALONE
from rig_identification.search.search import problem_of

Notify = Callable[[str, float], None]


def where_runs_disagree(ideal: Ideal, notify: Notify, budget: Budget) -> Explained | None:
    """What explains all runs where fitted ones are noise and held-out ones contradict; None: nothing does."""
    fitted = ideal.fitted
    if budget.spent() or shows(fitted.evaluation) or not hear(fitted).contradicting():
        return None
    notify("search: what runs that disagree lack", 0.1)
    together = _together(fitted)
    if together is None:
        return None
    problem, candidates = problem_of(ideal), catalogue(together.problem)

    def say(label: str) -> None:
        notify(f"search: {label}", 0.2)

    every = children(together.model, Standing(together), candidates, budget, say)
    for child in every:
        if budget.late():
            break
        say(f"whole runs with {child.label}")
        found = tuple(sparse(together.model, [child.trial(child.found[-1])], budget))
        try:
            # What held-out runs had a part in is no claim on the body
            told = whole_runs(ideal, Named(problem, found, budget, _rivals(child, every)))
        except (FloatingPointError, np.linalg.LinAlgError):
            continue
        if told.wholly:
            return in_words(_told(told, fitted), list(found))
    return None


def _rivals(told: Standing, every: list[Standing]) -> tuple[dict[str, object], ...]:
    """What trails the one that is told, as entries of ``alternatives``."""
    others = [s for s in every if s is not told and s.evidence <= told.evidence]
    return tuple(rival(s.trial(s.found[-1]), told.evidence - s.evidence) for s in others)


def _together(fitted: Fitted) -> Rung | None:
    """The ideal model fitted to all runs that can be followed; None where it cannot be."""
    problem, point = all_runs(fitted)
    try:
        evaluation, converged = solve(problem, point)
    except FloatingPointError:
        return None
    return Rung(problem, evaluation, ALONE) if converged else None


def _told(found: Explained, fitted: Fitted) -> Explained:
    """The explanation, and what chose it."""
    held = ", ".join(run.recording.name for run in fitted.holdout_runs)
    text = (
        f"{found.mismatch.explanation} The fitted runs alone are noise without it; that {held} asked for "
        "other parameters chose it, and fitted none of its numbers."
    )
    return replace(found, mismatch=replace(found.mismatch, explanation=text))
