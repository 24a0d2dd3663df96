"""Whole runs with what was found and no discrepancy, judged on held-out runs beside what hardly trails it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.solve import Problem, excess
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import compatible, count_of, worth_a_fit
from rig_identification.mismatch.outcome import Trials
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.standing import Heard, Search, unheard
from rig_identification.mismatch.trial import mass_of
from rig_identification.mismatch.undecided import undecided_beside
from rig_identification.mismatch.whole_rivals import likeliest_whole
from rig_identification.mismatch.whole_runs import pruned, whole_runs
from rig_identification.search.expand import Say, Standing, children
from rig_identification.search.ladder import Rung
from rig_identification.search.laws import in_words, sparse
from rig_identification.search.levels import ALONE

#: Effects that are told of a session at most.
MOST_EFFECTS = 3


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
    found = sparse(problem, [standing.trial(c) for c in standing.found], budget)
    last, earlier = found[-1], found[:-1]
    before = Search(
        problem,
        last.problem,
        last.evaluation,
        excess(ideal.fitted.evaluation),
        budget,
        found=list(earlier),
        heard=heard,
    )
    alike = [o.trial(o.found[-1]) for o in others if _comparable(o, standing)]
    tried = Trials([last, *alike])
    search = before.forked()
    search.adopt(tried, last)
    say("whole runs with " + standing.label)
    try:
        best = whole_runs(ideal, search)
        if best.wholly:
            best, search = likeliest_whole(
                ideal, before, tried, best, search, lambda label: say(f"whole runs with {label}")
            )
            best = _alone_or_with_one_more(ideal, problem, best, search, candidates, say)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None
    return in_words(best, search.found)


def _comparable(other: Standing, standing: Standing) -> bool:
    """Whether a model has another last effect beside the same others, and needs no stronger wrench."""
    same = other.found[:-1] == standing.found[:-1]
    return same and other.rung.level >= standing.rung.level and other.found[-1] != standing.found[-1]


def _alone_or_with_one_more(
    ideal: Ideal, problem: Problem, best: Explained, search: Search, candidates: list[Candidate], say: Say
) -> Explained:
    """What explains all, without what it can do without, or with what shows beside it within the noise."""
    kept = pruned(best, search, len(candidates))
    if kept is not best or len(search.found) == MOST_EFFECTS or search.budget.spent():
        return kept
    found = tuple(t.candidate for t in search.found)
    here, evaluation = best.fitted.problem, best.fitted.evaluation
    left = compatible(candidates, list(found))
    say("anything more within the noise")
    promises = screen(here, evaluation, left, mass_of(here, evaluation))
    if worth_a_fit(promises, count_of(left)):
        # What all residuals are noise with comes before what is found within that noise, and bends to it
        now = Standing(Rung(here, evaluation, ALONE), found)
        for child in children(problem, now, candidates, search.budget, say, promises)[:1]:
            more = replace(search.forked(), here=child.rung.problem, evaluation=child.rung.evaluation)
            more.found.append(child.trial(child.found[-1]))
            say("whole runs with " + child.label)
            both = whole_runs(ideal, more, as_found=True)
            if both.wholly:
                return both
    return undecided_beside(best, promises, count_of(left), lambda stage, _: say(stage), search.budget)
