"""The session with what was left out in the model: located, named, fitted, judged on held-out runs, told."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rig_identification.estimate.identify import Ideal, only_watched
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import catalogue, count_of
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.slack import Spell, slack_alone, taut_ideal, with_slack
from rig_identification.mismatch.trial import mass_of, ordinary_amount
from rig_identification.mismatch.undecided import undecided
from rig_identification.mismatch.whole_runs import Heard, ordinary_alone, unheard
from rig_identification.search.changed import Asked, changes_of, explained_changed
from rig_identification.search.disagreeing import where_runs_disagree
from rig_identification.search.events import events_beside, events_of, explained_outside, standing_out
from rig_identification.search.expand import worthy
from rig_identification.search.ladder import Rung
from rig_identification.search.levels import ALONE
from rig_identification.search.search import Outcome, first_rung, problem_of, search
from rig_identification.search.unexplained import unexplained
from rig_identification.search.wandering import wandering_zeros

Notify = Callable[[str, float], None]
#: Is told the last model with a discrepancy.
Seen = Callable[[Rung], None]


def explain(
    ideal: Ideal,
    spells: list[Spell],
    notify: Notify,
    budget: Budget,
    heard: Heard = unheard,
    seen: Seen = lambda rung: None,
) -> Explained | None:
    """Search for what the ideal model leaves out; None where every residual is noise, or no run is followed.

    spells: in which a cable carries nothing (slack.py). budget: how much it may compute. heard: is told what
    explains the session, as it is found.
    """
    if ideal.mismatch.verdict == "none":
        return _hidden(ideal, notify, budget)
    if not spells:
        return _explain(ideal, notify, budget, heard, seen)
    notify("search: stretches in which every cable pulls", 0.02)
    taut = taut_ideal(ideal, spells, notify)
    if taut is None:
        return slack_alone(ideal, spells)
    found = explain(taut, [], notify, budget, seen=seen)
    return with_slack(found or Explained(taut.fitted, taut.mismatch, taut), ideal, spells)


def _hidden(ideal: Ideal, notify: Notify, budget: Budget) -> Explained | None:
    """What no residual shows by itself, and a hypothesis that knows what to look for does.

    A score test of all hypotheses at once: one among ever so many that gains more than chance does is fitted,
    and told if it explains every run. Otherwise what may be there beside nothing is stated.
    """
    notify("search: anything within the noise", 0.1)
    problem, evaluation = problem_of(ideal), ideal.fitted.evaluation
    candidates = catalogue(problem)
    promises = screen(problem, evaluation, candidates, mass_of(problem, evaluation))
    count = count_of(candidates)
    # As much of it as every rig has would be no finding
    worth = [p for p in promises if not ordinary_amount(p.candidate, p.values)]
    if worthy(worth, count):
        found = search(ideal, Rung(problem, evaluation, ALONE), notify, budget, promises=worth).told
        if found is not None and found.wholly:
            return ordinary_alone(found)
    return undecided(ideal, problem, evaluation, promises, count, notify, budget)


def _explain(
    ideal: Ideal, notify: Notify, budget: Budget, heard: Heard, seen: Seen, *, part: bool = False
) -> Explained | None:
    """The search, on runs in which every cable pulls.

    part: these are what an event leaves of them; None then also where they are not explained.
    """

    def rest_explained(rest: Ideal) -> Explained | None:
        if rest.mismatch.verdict == "none":
            return _hidden(rest, notify, budget)
        return _explain(rest, notify, budget, unheard, lambda rung: None, part=True) or _nothing(rest)

    notify("search: the motion as recorded", 0.05)
    first = _first(ideal)
    if first is None:
        return None
    # A body that is only watched tells no wrench, and where it swings free is known (segments.py)
    watched = only_watched(ideal.fitted.problem)
    if not watched:
        seen(first)
    events = () if watched else events_of(ideal, first)
    if events:
        found = explained_outside(ideal, events, rest_explained, notify, chief=True)
        if found is not None:
            return found
    asked = Asked([], False) if watched or budget.spent() else changes_of(ideal.fitted, first)
    if asked.leading:
        found = explained_changed(ideal, asked.changes, rest_explained, notify)
        if found is not None:
            return found
    agreed = where_runs_disagree(ideal, notify, budget) if first.alone and not watched else None
    if agreed is not None:
        return agreed
    outcome = search(ideal, first, notify, budget, heard)
    if outcome.told is not None or watched:
        return None if outcome.told is None else ordinary_alone(outcome.told)
    seen(outcome.rung)
    found = _beside(ideal, outcome, rest_explained, notify, budget)
    if found is None and asked.changes and not asked.leading:
        found = explained_changed(ideal, asked.changes, rest_explained, notify)
    if found is not None or part:
        return found
    return wandering_zeros(ideal, notify, budget) or unexplained(ideal, outcome, budget, notify)


def _nothing(rest: Ideal) -> Explained:
    """What is left of a session, unexplained."""
    return Explained(rest.fitted, rest.mismatch, rest)


def _first(ideal: Ideal) -> Rung | None:
    try:
        return first_rung(ideal)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None


def _beside(
    ideal: Ideal,
    outcome: Outcome,
    rest_explained: Callable[[Ideal], Explained | None],
    notify: Notify,
    budget: Budget,
) -> Explained | None:
    """What explains the session outside of an event that shows with the likeliest effects in the model."""
    if budget.spent() or not outcome.likeliest.found:
        return None
    events = () if outcome.partly is None else events_beside(outcome.partly)
    if not events and not outcome.likeliest.rung.alone:
        events = standing_out(outcome.rung)
    return explained_outside(ideal, events, rest_explained, notify, chief=False) if events else None
