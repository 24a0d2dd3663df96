"""What the recordings neither show nor exclude, where every residual is noise.

Of a hundred hypotheses one gains ten nats by chance; none is told for that. Yet what gains nearly as much may
be there, and where it is alike to inertia (entrained air, an exciter's rotor) the body that the ideal model
makes of the recordings is another one than with it. So it is fitted, stated as an alternative to there being
nothing, and the body's interval covers both (estimate/mixture.py).

How far it trails: half the log of how much sharper the recordings know its amount than the prior does, and
the log of the number of hypotheses that are as likely as it is beforehand, less what it gains. Where several
places of one effect explain as much, as upper hinges that share a load do, their likelihoods add: that some
hinge is off is likelier than that this one is. What every rig has some of, as all cables weigh and all bodies
take air along, is no chance among many: of that only the amount is asked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from rig_identification.estimate.identify import ORDINARY, Ideal
from rig_identification.estimate.mixture import Bodies
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.verdict import DOUBTED
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import called, rival
from rig_identification.mismatch.opened import Promise
from rig_identification.mismatch.trial import (
    Trial,
    beyond_doubt,
    fitted_to_its_end,
    log_evidence,
    ordinary_errors,
)

Notify = Callable[[str, float], None]

#: Nats by which an explanation may trail and still be stated, and how many effects are, at most ("not worth
#: more than a bare mention" up to one nat, "positive" up to three: Kass and Raftery, J. Am. Stat. Assoc. 90,
#: 1995).
TIED, STATED = 3.0, 3
#: Of those that first order tells of so many are fitted at most: what it takes for little may be nothing.
ASKED = 6


def undecided(
    ideal: Ideal,
    problem: Problem,
    evaluation: Evaluation,
    promises: list[Promise],
    count: int,
    notify: Notify,
    budget: Budget,
) -> Explained | None:
    """The ideal model's answer with what it cannot exclude beside it; None where that is nothing.

    promises: about ``evaluation``, of ``count`` hypotheses.
    """
    stated = _neither_shown_nor_excluded(problem, evaluation, promises, count, notify, budget)
    if not stated:
        return None
    mismatch = replace(
        ideal.mismatch,
        explanation=f"{ideal.mismatch.explanation} {_sentence(stated)}",
        alternatives=tuple(rival(t, gap) for gap, t in stated),
    )
    return Explained(ideal.fitted, mismatch, ideal, bodies=_bodies(stated))


def undecided_beside(
    best: Explained, promises: list[Promise], count: int, notify: Notify, budget: Budget
) -> Explained:
    """An explanation that leaves only noise, with what may be there beside it in the body's interval.

    It is no alternative to what is told, and stands in the explanation alone. promises: about its fit.
    """
    fitted = best.fitted
    stated = _neither_shown_nor_excluded(fitted.problem, fitted.evaluation, promises, count, notify, budget)
    if not stated:
        return best
    explanation = f"{best.mismatch.explanation} {_sentence(stated)}"
    return replace(
        best,
        mismatch=replace(best.mismatch, explanation=explanation),
        bodies=(*best.bodies, *_bodies(stated)),
    )


def shared_by_places(trailing: Iterable[tuple[str, float]]) -> dict[str, float]:
    """Nats by which an effect anywhere is likelier than at its likeliest place, by kind.

    trailing: kind of every hypothesis, and nats by which it trails.
    """
    behind: dict[str, list[float]] = {}
    for kind, gap in trailing:
        behind.setdefault(kind, []).append(gap)
    return {kind: min(gaps) + float(logsumexp(-np.array(gaps))) for kind, gaps in behind.items()}


def _neither_shown_nor_excluded(
    problem: Problem,
    evaluation: Evaluation,
    promises: list[Promise],
    count: int,
    notify: Notify,
    budget: Budget,
) -> list[tuple[float, Trial]]:
    """Hypotheses that trail by little, and by how much (nats), best first."""
    nothing = log_evidence(evaluation)
    ordinary = ordinary_errors(problem)

    def chance(candidate: Candidate) -> float:
        if candidate.everywhere:
            return 0.0
        return float(np.log(count / (DOUBTED if candidate.doubted else 1.0)))

    def trails(promise: Promise) -> float:
        return (promise.charge or 0.0) + chance(promise.candidate) - promise.gain

    known = [p for p in promises if p.charge is not None]
    shared = shared_by_places((p.candidate.kind, trails(p)) for p in known)

    def trails_anywhere(promise: Promise) -> float:
        return trails(promise) - shared[promise.candidate.kind]

    close = [p for p in known if trails_anywhere(p) < TIED]
    stated: list[tuple[float, Trial]] = []
    for promise in sorted(close, key=trails_anywhere)[:ASKED]:
        if len(stated) == STATED or budget.spent():
            break
        if any(t.candidate.kind == promise.candidate.kind for _, t in stated):
            # Its other places are its rivals anyway
            continue
        notify(f"search: {promise.candidate.label}, which may be there", 0.5)
        ended = fitted_to_its_end(problem, evaluation, promise, budget)
        if ended is None or not ended.settled or not beyond_doubt(ended, ordinary, ORDINARY):
            continue
        gap = nothing + chance(promise.candidate) - ended.evidence - shared[promise.candidate.kind]
        if gap < TIED:
            stated.append((max(gap, 0.0), ended))
    return sorted(stated, key=lambda s: s[0])


def _sentence(stated: list[tuple[float, Trial]]) -> str:
    named = " and ".join(
        dict.fromkeys(called(trial.candidate.effect, trial.candidate.where) for _, trial in stated)
    )
    return f"Whether there is {named} they neither show nor exclude."


def _bodies(stated: list[tuple[float, Trial]]) -> Bodies:
    """What each makes of the body."""
    return tuple((gap, inertial_estimate(t.problem, t.evaluation)) for gap, t in stated)
