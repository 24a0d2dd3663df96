"""Whole runs with what was found and no discrepancy, judged on held-out runs beside what hardly trails it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

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


class Model(NamedTuple):
    """Effects of a model as fits without a discrepancy have them."""

    earlier: tuple[Trial, ...]
    last: Trial  # in which it differs from what it is compared with

    @property
    def evidence(self) -> float:
        """Log evidence with all of them."""
        return self.last.evidence

    @property
    def numbers(self) -> int:
        """How many its effects have together."""
        return sum(len(t.candidate.parameters) for t in (*self.earlier, self.last))

    @property
    def label(self) -> str:
        """Names of its effects."""
        return ", ".join(t.candidate.label for t in (*self.earlier, self.last))


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

    problem: without any effect. others: further models, likeliest first: of those that differ in one effect
    and hardly trail it the one that the held-out runs say most for is told.
    """
    ranked = [_model(standing, standing.found[-1])]
    for other in others:
        differs = _in_one(other, standing)
        if differs is not None:
            ranked.append(_model(other, differs))
    say("whole runs with " + standing.label)
    try:
        named = Named(problem, (*ranked[0].earlier, ranked[0].last), budget, heard=heard)
        named = _beside_rivals(named, [model.last for model in ranked[1:]])
        best = whole_runs(ideal, named)
        named, best = _made_sparse(ideal, named, best)
        ranked[0] = Model(named.found[:-1], named.found[-1])
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


def _model(standing: Standing, differs: Candidate) -> Model:
    """A model as whole runs begin with it."""
    earlier = tuple(standing.trial(c) for c in standing.found if c is not differs)
    return Model(earlier, standing.trial(differs))


def _in_one(other: Standing, standing: Standing) -> Candidate | None:
    """The effect in which a model differs from ``standing``; None: in more, or it needs a stronger wrench."""
    differs = [c for c in other.found if c not in standing.found]
    alike = len(other.found) == len(standing.found) and len(differs) == 1
    return differs[0] if alike and other.rung.level >= standing.rung.level else None


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
    ideal: Ideal, named: Named, best: Explained, ranked: list[Model], say: Say
) -> tuple[Named, Explained, list[Model]]:
    """The likeliest of the close rivals that explains all, where the first of them does not.

    best: whole runs with the first. Returns what is given where none does. Where the first one leaves but a
    trace, one with more numbers of its own is not asked: it bends to that.
    """
    for k, model in enumerate(ranked[1:], start=1):
        if named.budget.spent() or ranked[0].evidence - model.evidence > CLOSE:
            break
        if best.told and model.numbers > ranked[0].numbers:
            continue
        its = replace(named, found=(*model.earlier, model.last))
        its = _beside_rivals(its, [other.last for other in ranked[k + 1 :]])
        say("whole runs with " + model.label)
        found = whole_runs(ideal, its)
        if found.wholly:
            return its, found, ranked[k:]
    return named, best, ranked


def _likeliest(
    ideal: Ideal, named: Named, best: Explained, ranked: list[Model], say: Say
) -> tuple[Named, Explained]:
    """What all runs say most for, held-out ones among them, of models ``ranked`` by the fitted ones.

    best: whole runs with the first of them, which leave only noise. One with more numbers of its own bends
    to what is left, and is not asked.
    """
    first = ranked[0]
    heard = [(first, named, best)]
    for model in ranked[1:]:
        plain = model.numbers <= first.numbers
        if named.budget.spent() or first.evidence - model.evidence > CLOSE or not plain:
            continue
        its = replace(named, found=(*model.earlier, model.last))
        say("whole runs with " + model.label)
        heard.append((model, its, whole_runs(ideal, its)))
    if len(heard) == 1:
        return named, best
    held = [held_out_densities(found.fitted) for _, _, found in heard]
    # A run that one of them cannot follow tells nothing of the others
    followed = set.intersection(*(set(densities) for densities in held))
    said = [
        _over_all(model.last, found) + sum(densities[key] for key in followed)
        for (model, _, found), densities in zip(heard, held, strict=True)
    ]
    chosen = max((k for k, h in enumerate(heard) if h[2].wholly), key=lambda k: said[k])
    (earlier, last), its, found = heard[chosen]
    fitted = {
        id(model.last): replace(as_fitted(explained.fitted, model.last), evidence=all_runs)
        for (model, _, explained), all_runs in zip(heard, said, strict=True)
    }
    every = [model.last for model in ranked]
    trailing = [fitted[id(t)] for t in every if id(t) in fitted and t is not last]
    # Of those that were not asked what the fitted runs say stays
    behind = said[chosen] - last.evidence
    trailing += [replace(t, evidence=t.evidence + behind) for t in every if id(t) not in fitted]
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
    return undecided_beside(
        best, promises, count_of(left), lambda stage, _: say(stage.removeprefix("search: ")), named.budget
    )
