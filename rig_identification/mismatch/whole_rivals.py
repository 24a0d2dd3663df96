"""Hypotheses that hardly trail the likeliest one, told apart by whole runs and by runs that were held out.

Short pieces each have a start of their own: what adds up over half a minute, how a swing dies away or falls
out of step, is lost to them, and an effect of many numbers bends to what is left as well as the right one
does. Nor do fitted runs tell what was bent to them. So where the likeliest hypothesis explains all, those
that trail it by little and have no more numbers of their own are fitted to whole runs as well, and the
evidence of these decides together with what the held-out runs add to it (constancy.log_predictive).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.verdict import held_out_densities
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.first_fits import BEATEN
from rig_identification.mismatch.in_motion import cost_in_motion
from rig_identification.mismatch.late import SETTLING, twins
from rig_identification.mismatch.outcome import MEANT, Trials
from rig_identification.mismatch.standing import Search
from rig_identification.mismatch.trial import Trial, among_places, earned_evidence
from rig_identification.mismatch.whole_runs import as_fitted, whole_runs


def likeliest_whole(
    ideal: Ideal,
    before: Search,
    tried: Trials,
    best: Explained,
    search: Search,
    notify: Callable[[str], None],
) -> tuple[Explained, Search]:
    """What all runs say most for, and how it was found.

    best: whole runs with the first of what was ``tried``, which leave only noise; search: how it was found;
    before: where the search stood before any of them was adopted.
    """
    first = tried.done[0]
    heard: list[tuple[Trial, Explained, Search]] = [(first, best, search)]
    for trial in _close(first, (*tried.done[1:], *tried.beaten)):
        if search.budget.spent():
            break
        its = before.forked()
        its.adopt(tried, trial)
        notify(", ".join(t.candidate.label for t in its.found))
        heard.append((trial, whole_runs(ideal, its), its))
    if len(heard) == 1:
        return best, search
    held = [held_out_densities(found.fitted) for _, found, _ in heard]
    # A run that one of them cannot follow tells nothing of the others
    followed = set.intersection(*(set(densities) for densities in held))
    said = {
        id(trial): (trial.evidence if before.whole else _evidence(ideal, trial, found))
        + sum(densities[key] for key in followed)
        for (trial, found, _), densities in zip(heard, held, strict=True)
    }
    convincing = [h for h in heard if h[1].wholly]
    chosen, best, search = max(convincing, key=lambda h: said[id(h[0])])
    gaps = [
        (max(0.0, said[id(chosen)] - said[id(t)]), as_fitted(found.fitted, t))
        for t, found, _ in heard
        if t is not chosen
    ]
    others = [(gap, t) for gap, t in tried.rivals_of(first) if id(t) not in said]
    stated = sorted([*gaps, *others], key=lambda gap: gap[0])
    search.rivals = [*before.rivals, *(rival(t, gap) for gap, t in stated)]
    seen = stated if before.whole else gaps
    search.bodies = tuple((gap, inertial_estimate(t.problem, t.evaluation)) for gap, t in seen)
    told = replace(best.mismatch, alternatives=tuple(search.rivals))
    return replace(best, mismatch=told, bodies=search.bodies), search


def _close(first: Trial, others: tuple[Trial, ...]) -> list[Trial]:
    """Those of ``others`` that trail the first by little and have no more numbers to bend, in their order."""
    plain = len(first.candidate.parameters)
    return [
        t
        for t in others
        if first.evidence - t.evidence < BEATEN
        and len(t.candidate.parameters) <= plain
        and not twins(first.candidate, t.candidate)
    ]


def outdone(ideal: Ideal, first: Trial, traced: Explained, other: Trial, wholly: Explained) -> bool:
    """Whether what explains all but a trace is so much likelier that what explains all is none of it.

    traced, wholly: whole runs with ``first`` and with ``other``. A doubt that lies a little beyond its
    tolerances is such a trace, and its evidence is charged for it already.
    """
    if twins(first.candidate, other.candidate):
        costs = [cost_in_motion(e.fitted.problem, e.fitted.evaluation, SETTLING) for e in (wholly, traced)]
        return costs[0] - costs[1] > MEANT
    return ahead_by(ideal, (first, traced), (other, wholly)) > BEATEN


def ahead_by(ideal: Ideal, one: tuple[Trial, Explained], other: tuple[Trial, Explained]) -> float:
    """Log evidence of whole runs by which ``one`` is ahead of ``other``, what held-out runs add included."""
    held = [held_out_densities(found.fitted) for _, found in (one, other)]
    heard = sum(held[0][key] - held[1][key] for key in held[0].keys() & held[1].keys())
    return _evidence(ideal, *one) - _evidence(ideal, *other) + heard


def _evidence(ideal: Ideal, trial: Trial, found: Explained) -> float:
    """Log evidence of whole runs with an effect; near the noise, less what is gained from that alone."""
    before = ideal.fitted.evaluation
    far = misfit(before) > NEAR_SQUARE
    evidence = earned_evidence(ideal.fitted.problem, before, found.fitted.evaluation, far=far)
    return among_places(replace(trial, evidence=evidence)).evidence
