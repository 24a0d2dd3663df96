"""Whole runs with what was found and no discrepancy, judged on held-out runs beside what hardly trails it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.verdict import held_out_densities
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.hypotheses import compatible, count_of
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import Trial, log_evidence, mass_of
from rig_identification.mismatch.undecided import undecided_beside
from rig_identification.mismatch.whole_runs import (
    Heard,
    Named,
    as_fitted,
    fitted_whole,
    pruned,
    unheard,
    whole_runs,
)
from rig_identification.search.expand import MEANT, Say, Standing, children, special_cases, worthy
from rig_identification.search.ladder import Rung
from rig_identification.search.laws import in_words, sparse
from rig_identification.search.levels import ALONE

#: Effects that are told of a session at most.
MOST_EFFECTS = 3
#: Log evidence by which a hypothesis may trail that held-out runs are still asked about.
CLOSE = 30.0


def in_whole_runs(
    ideal: Ideal,
    problem: Problem,
    standing: Standing,
    others: list[Standing],
    candidates: list[Candidate],
    budget: Budget,
    say: Say,
    heard: Heard = unheard,
) -> Explained | None:
    """Whole runs with the effects of ``standing``; None where they cannot be fitted.

    problem: without any effect. others: with another last effect, likeliest first: of those that hardly
    trail it the one that the held-out runs say most for is told.
    """
    found = [standing.trial(c) for c in standing.found]
    alike = [o.trial(o.found[-1]) for o in others if _comparable(o, standing)]
    ranked = [found[-1], *alike]
    earlier = tuple(found[:-1])
    say("whole runs with " + standing.label)
    try:
        named = _beside_rivals(Named(problem, (*earlier, ranked[0]), budget, heard=heard), ranked[1:])
        best = whole_runs(ideal, named)
        named, best = _made_sparse(ideal, named, best)
        ranked[0] = named.found[-1]
        if not best.wholly:
            named, best, ranked = _next_likely(ideal, named, best, ranked, say)
        if best.wholly:
            named, best = _likeliest(ideal, named, best, ranked, say)
            named, best = _simplified(ideal, named, best, candidates, say)
            best = _alone_or_with_one_more(ideal, problem, best, named, candidates, say)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None
    return in_words(best, list(named.found))


def _made_sparse(ideal: Ideal, named: Named, best: Explained) -> tuple[Named, Explained]:
    """Whole runs without those parts of a law that they do not show, where that explains as much."""
    fitted = [as_fitted(best.fitted, t) for t in named.found]
    less = sparse(named.problem, fitted, named.budget)
    if less is fitted:
        return named, best
    found = [replace(now, evidence=t.evidence) for now, t in zip(less, named.found, strict=True)]
    its = replace(named, found=tuple(found))
    again = whole_runs(ideal, its)
    return (its, again) if again.told or not best.told else (named, best)


def _comparable(other: Standing, standing: Standing) -> bool:
    """Whether a model has another last effect beside the same others, and needs no stronger wrench."""
    same = other.found[:-1] == standing.found[:-1]
    return same and other.rung.level >= standing.rung.level and other.found[-1] != standing.found[-1]


def _beside_rivals(named: Named, others: list[Trial]) -> Named:
    """The same with other last effects stated as rivals."""
    last = named.found[-1]
    gaps = [(max(0.0, last.evidence - t.evidence), t) for t in others]
    return replace(
        named,
        rivals=tuple(rival(t, gap) for gap, t in gaps),
        bodies=tuple((gap, inertial_estimate(t.problem, t.evaluation)) for gap, t in gaps),
    )


def _next_likely(
    ideal: Ideal, named: Named, best: Explained, ranked: list[Trial], say: Say
) -> tuple[Named, Explained, list[Trial]]:
    """The likeliest of the close rivals that explains all, where the first of them does not.

    best: whole runs with the first. Returns what is given where none does.
    """
    earlier = named.found[:-1]
    for k, trial in enumerate(ranked[1:], start=1):
        if named.budget.spent() or ranked[0].evidence - trial.evidence > CLOSE:
            break
        its = _beside_rivals(replace(named, found=(*earlier, trial)), ranked[k + 1 :])
        say("whole runs with " + trial.candidate.label)
        found = whole_runs(ideal, its)
        if found.wholly:
            return its, found, ranked[k:]
    return named, best, ranked


def _likeliest(
    ideal: Ideal, named: Named, best: Explained, ranked: list[Trial], say: Say
) -> tuple[Named, Explained]:
    """What all runs say most for, held-out ones among them, of last effects ``ranked`` by the fitted ones.

    best: whole runs with the first of them, which leave only noise. One with more numbers of its own bends
    to what is left, and is not asked.
    """
    first, earlier = ranked[0], named.found[:-1]
    heard = [(first, named, best)]
    for trial in ranked[1:]:
        plain = len(trial.candidate.parameters) <= len(first.candidate.parameters)
        if named.budget.spent() or first.evidence - trial.evidence > CLOSE or not plain:
            continue
        its = replace(named, found=(*earlier, trial))
        say("whole runs with " + trial.candidate.label)
        heard.append((trial, its, whole_runs(ideal, its)))
    if len(heard) == 1:
        return named, best
    held = [held_out_densities(found.fitted) for _, _, found in heard]
    # A run that one of them cannot follow tells nothing of the others
    followed = set.intersection(*(set(densities) for densities in held))
    said = [
        _over_all(t, found) + sum(densities[key] for key in followed)
        for (t, _, found), densities in zip(heard, held, strict=True)
    ]
    chosen = max((k for k, h in enumerate(heard) if h[2].wholly), key=lambda k: said[k])
    last, its, found = heard[chosen]
    fitted = {
        id(t): replace(as_fitted(explained.fitted, t), evidence=all_runs)
        for (t, _, explained), all_runs in zip(heard, said, strict=True)
    }
    trailing = [fitted[id(t)] for t in ranked if id(t) in fitted and t is not last]
    # Of those that were not asked what the fitted runs say stays
    behind = said[chosen] - last.evidence
    trailing += [replace(t, evidence=t.evidence + behind) for t in ranked if id(t) not in fitted]
    its = _beside_rivals(replace(its, found=(*earlier, replace(last, evidence=said[chosen]))), trailing)
    told = replace(found.mismatch, alternatives=its.rivals)
    return its, replace(found, mismatch=told, bodies=its.bodies)


def _over_all(trial: Trial, found: Explained) -> float:
    """Log evidence of a trial that was fitted to the first part of runs, over all of them."""
    return trial.evidence - log_evidence(trial.evaluation) + log_evidence(found.fitted.evaluation)


def _simplified(
    ideal: Ideal, named: Named, best: Explained, candidates: list[Candidate], say: Say
) -> tuple[Named, Explained]:
    """What explains all, each effect as its special case where that is likelier.

    Beside something else that is wrong a cell that feels its neighbour, and is off, explains more than one
    that is off. Once the other thing is known it may explain no more.
    """
    for trial in named.found:
        for simple in special_cases(trial.candidate, candidates):
            if named.budget.spent():
                return named, best
            say("whole runs with " + simple.label)
            found = [replace(trial, candidate=simple) if t is trial else t for t in named.found]
            now = best.fitted
            less = fitted_whole(ideal, named, found, now.problem, now.evaluation.point)
            if less.wholly and log_evidence(less.fitted.evaluation) > log_evidence(now.evaluation):
                fitted = tuple(as_fitted(less.fitted, t) for t in found)
                return _simplified(ideal, replace(named, found=fitted), less, candidates, say)
    return named, best


def _alone_or_with_one_more(
    ideal: Ideal, problem: Problem, best: Explained, named: Named, candidates: list[Candidate], say: Say
) -> Explained:
    """What explains all, without what it can do without, or with what shows beside it within the noise."""
    kept = pruned(best, named, len(candidates))
    if kept is not best or len(named.found) == MOST_EFFECTS or named.budget.spent():
        return kept
    found = tuple(t.candidate for t in named.found)
    here, evaluation = best.fitted.problem, best.fitted.evaluation
    left = compatible(candidates, list(found))
    say("anything more within the noise")
    promises = screen(here, evaluation, left, mass_of(here, evaluation))
    if worthy(promises, count_of(left)):
        # What all residuals are noise with comes before what is found within that noise, and bends to it
        now = Standing(Rung(here, evaluation, ALONE), found)
        for child in children(problem, now, candidates, named.budget, say, promises)[:1]:
            if child.evidence < now.evidence + MEANT:
                continue
            say("whole runs with " + child.label)
            both = whole_runs(
                ideal, replace(named, found=(*named.found, child.trial(child.found[-1]))), as_found=True
            )
            if both.wholly:
                return both
    return undecided_beside(best, promises, count_of(left), lambda stage, _: say(stage), named.budget)
