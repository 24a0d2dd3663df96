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

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import ORDINARY, Ideal
from rig_identification.estimate.solve import Evaluation, Problem, solve
from rig_identification.estimate.verdict import hear
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.first_fits import shows
from rig_identification.mismatch.hypotheses import catalogue, count_of, worth_a_fit
from rig_identification.mismatch.screen import screen, with_reference
from rig_identification.mismatch.search import trials
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import mass_of
from rig_identification.mismatch.whole_runs import whole_runs

Notify = Callable[[str, float], None]


def where_runs_disagree(ideal: Ideal, notify: Notify, budget: Budget) -> Explained | None:
    """What explains all runs where fitted ones are noise and held-out ones contradict; None: nothing does.

    ideal: the ideal model, whose fit nothing that was looked for in the fitted runs alone explains.
    """
    fitted = ideal.fitted
    if budget.spent() or shows(fitted.evaluation) or not hear(fitted).contradicting():
        return None
    notify("search: what runs that disagree lack", 0.75)
    together = _together(fitted)
    if together is None:
        return None
    problem, evaluation = together
    candidates = catalogue(problem)
    promises = screen(problem, evaluation, candidates, mass_of(problem, evaluation))
    if not worth_a_fit(promises, count_of(candidates)):
        return None
    tried = trials(
        problem,
        evaluation,
        candidates,
        ORDINARY,
        lambda label: notify(f"search: {label}", 0.8),
        promises,
        budget,
    )
    alone = with_reference(fitted.problem, fitted.rest)
    for trial in tried.done:
        if budget.late():
            break
        search = Search(alone, problem, evaluation, 0.0, budget)
        search.adopt(tried, trial)
        notify(f"search: whole runs with {trial.candidate.label}", 0.85)
        # What held-out runs had a part in is no claim on the body
        found = whole_runs(ideal, replace(search, bodies=()))
        if found.wholly:
            return _told(found, fitted)
    return None


def _together(fitted: Fitted) -> tuple[Problem, Evaluation] | None:
    """All runs that can be followed as one problem, and the ideal model fitted to it."""
    problem = with_reference(fitted.problem, fitted.rest)
    problem = replace(problem, runs=(*problem.runs, *fitted.holdout_runs))
    point = fitted.evaluation.point
    starts = (*point.starts, *(held.motion.state(0) for held in fitted.holdouts))
    try:
        evaluation, converged = solve(problem, replace(point, starts=starts))
    except FloatingPointError:
        return None
    return (problem, evaluation) if converged else None


def _told(found: Explained, fitted: Fitted) -> Explained:
    """The explanation, and what chose it."""
    held = ", ".join(run.recording.name for run in fitted.holdout_runs)
    text = (
        f"{found.mismatch.explanation} The fitted runs alone are noise without it; that {held} asked for "
        "other parameters chose it, and fitted none of its numbers."
    )
    return replace(found, mismatch=replace(found.mismatch, explanation=text))
