"""A session that a law of one point's motion explains (point_laws.py), where no entry of the catalogue does.

Where the ideal model fails by far its motion is not the body's, and what a law would do along it tells
nothing. A random wrench beside the model stands for all that it lacks: with it the model follows what was
measured, and a law is looked for along that motion, by how much of the random wrench it makes needless. What
the body's inertia can account for as well is free meanwhile, so that no law stands for that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.growing import NEAR_SQUARE, held_over, misfit, settled_starts
from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import POLISH, Evaluation, Point, Problem, evaluate, shortened, solve
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.first_fits import AT_NOISE, BEATEN
from rig_identification.mismatch.measured import fitting_wrench
from rig_identification.mismatch.outcome import MEANT, Law, Trials
from rig_identification.mismatch.point_laws import (
    SEEN,
    law_finding,
    parts_of,
    point_laws,
    sparser,
)
from rig_identification.mismatch.screen import Promise, carried, extended
from rig_identification.mismatch.search import worst_pieces
from rig_identification.mismatch.standing import EXPLAINED, Search
from rig_identification.mismatch.trial import Trial, in_stds, log_evidence, mass_of, promised
from rig_identification.mismatch.whole_rivals import ahead_by
from rig_identification.mismatch.whole_runs import as_fitted, whole_runs

Array = NDArray[np.float64]
Notify = Callable[[str, float], None]

#: Ends (s) of the horizons over which a law is fitted where much is left, before the whole pieces.
HORIZONS = (0.3, 0.6, 1.0, 1.5)
#: Steps over each of them, and to the end.
STEPS, LAST_STEPS = 8, 20
#: Laws that are fitted: a line between two that are tried is led to from one of them alone.
FITTED = 2
#: Std by which the strongest part of a law has to be seen: twice what one needs to stay.
CERTAIN = 2.0 * SEEN
#: s, to which the runs of a law's fit grow after the first horizons: straight to all its steps are lost.
LONGER = (4.0, 8.0)


def lawful(
    ideal: Ideal,
    search: Search,
    trial: Trial,
    notify: Notify,
    instead: tuple[Trial, Explained] | None = None,
) -> Explained | None:
    """What explains all runs with a law in the model; None where it does not.

    search: as it stands at the ideal model; it is left as it is. instead: an entry of the catalogue that
    explains the session, but for a trace perhaps; the law has to be likelier.
    """
    own = replace(search, found=[], rivals=[], screened=None)
    own.adopt(Trials([trial]), trial)
    if misfit(own.evaluation) > EXPLAINED:
        return None
    notify("search: whole runs with the law", 0.8)
    best = whole_runs(ideal, own)
    if not best.told:
        return None
    if best.trace and (instead is None or not instead[1].trace):
        # A name of the catalogue may leave a trace; what has no name has nothing else to speak for it
        return None
    mismatch, bodies = best.mismatch, best.bodies
    if instead is not None:
        name, named = instead
        gap = ahead_by(ideal, (trial, best), instead)
        if gap < (MEANT if best.trace or not named.trace else -BEATEN):
            # As of two names, what explains it all goes before what leaves a trace unless it is outdone
            return None
        fitted = as_fitted(named.fitted, name)
        mismatch = replace(mismatch, alternatives=(rival(fitted, gap), *mismatch.alternatives))
        bodies = (*bodies, (gap, inertial_estimate(fitted.problem, fitted.evaluation)))
    finding = law_finding(best.fitted, trial.candidate, mismatch.findings[0])
    return replace(best, mismatch=replace(mismatch, findings=(finding,)), bodies=bodies)


def law_of_pieces(ideal: Ideal, search: Search, notify: Notify) -> Law:
    """What explains the session with a law where pieces that are tried on do not refute it.

    search: as it stands before anything is found.
    """

    def law(here: Problem, seen: Evaluation, needed: float) -> Explained | None:
        trial = law_trial(here, seen, mass_of(here, seen), search.budget)
        return lawful(ideal, search, trial, notify) if trial is not None and trial.evidence > needed else None

    return law


def lawful_instead(
    ideal: Ideal,
    search: Search,
    notify: Notify,
    first: Trial | None = None,
    explained: Explained | None = None,
) -> Explained | None:
    """What explains all runs with a law where the catalogue did not; None where nothing does.

    search: as it stood before the catalogue's turn. first: hypothesis that short pieces did not refute, and
    what it ``explained`` of whole runs, where it did.
    """
    here, evaluation = search.here, search.evaluation
    if not search.whole:
        here, evaluation = worst_pieces(here, evaluation)
    trial = law_trial(here, evaluation, mass_of(here, evaluation), search.budget)
    if trial is None:
        return None
    same = first is not None and len(first.problem.runs) == len(here.runs)
    if first is not None and same and trial.evidence < first.evidence:
        return None
    instead = (first, explained) if first is not None and explained is not None else None
    return lawful(ideal, search, trial, notify, instead)


def law_trial(problem: Problem, evaluation: Evaluation, mass: float, budget: Budget) -> Trial | None:
    """The likeliest law with no more parts than are seen, fitted; None where none leaves only noise."""
    followed = fitting_wrench(problem, evaluation.point, mass)
    if followed is None:
        return None
    noisy, point = followed
    along = evaluate(noisy, point)
    if along is None:
        return None
    best: Trial | None = None
    for law in point_laws(noisy, along, mass)[:FITTED]:
        if budget.spent():
            break
        trial = _fitted(problem, evaluation, point, law, budget)
        if trial is not None and (best is None or trial.evidence > best.evidence):
            best = trial
    if best is None or misfit(best.evaluation) > AT_NOISE:
        return None
    sparse = made_sparse(problem, best, budget)
    seen = in_stds(sparse)
    # What takes away so much and is hardly seen itself stands in for something else
    return sparse if max(abs(seen[q.name]) for q in parts_of(sparse.candidate)) > CERTAIN else None


def _fitted(
    problem: Problem, evaluation: Evaluation, point: Point, law: Promise, budget: Budget
) -> Trial | None:
    """A law fitted to its end from where the wrench that stood for it left the starts."""
    candidate = law.candidate
    wide = extended(problem, (candidate,))
    # The body as it was: what the motion alone tells of it comes with the law
    start = carried(wide, problem, replace(point, latents=()))
    there = promised(wide, start, candidate, law.values, evaluation)
    try:
        if misfit(evaluation) > NEAR_SQUARE:
            for end in HORIZONS:
                part = held_over(wide, end, there.theta[:INERTIAL].copy())
                reached = _grown(part, there, STEPS, budget)[0]
                if end > HORIZONS[0] and misfit(reached) > NEAR_SQUARE:
                    # What a law does not explain over a second it will not over two
                    return None
                there = reached.point
            longest = max(run.grid.duration for run in wide.runs)
            for end in (end for end in LONGER if end < longest):
                there = _grown(shortened(wide, end), there, STEPS, budget)[0].point
        fitted, settled = _grown(wide, there, LAST_STEPS, budget)
    except FloatingPointError:
        return None
    return Trial(candidate, wide, fitted, log_evidence(fitted), settled)


def _grown(problem: Problem, point: Point, steps: int, budget: Budget) -> tuple[Evaluation, bool]:
    """Longer runs than those of ``point``, their start states settled before anything else moves."""
    return _solved(problem, replace(point, starts=settled_starts(problem, point)), steps, budget)


def _solved(problem: Problem, point: Point, steps: int, budget: Budget) -> tuple[Evaluation, bool]:
    return solve(problem, point, iterations=steps, tolerance=0.1, polish=POLISH, stop=budget.spent)


def made_sparse(problem: Problem, trial: Trial, budget: Budget) -> Trial:
    """The trial less the parts of its law that are not seen, one after the other."""
    while True:
        less: Candidate | None = sparser(trial.candidate, in_stds(trial))
        if less is None:
            return trial
        wide = extended(problem, (less,))
        try:
            fitted, settled = _solved(
                wide, carried(wide, trial.problem, trial.evaluation.point), LAST_STEPS, budget
            )
        except FloatingPointError:
            return trial
        trial = Trial(less, wide, fitted, log_evidence(fitted), settled)
