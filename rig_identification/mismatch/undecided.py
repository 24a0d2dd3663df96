"""What the recordings neither show nor exclude, where every residual is noise.

Of a hundred hypotheses one gains ten nats by chance; none is told for that. Yet what gains nearly as much may
be there, and where it is alike to inertia (entrained air, an exciter's rotor) the body that the ideal model
makes of the recordings is another one than with it. So it is fitted, stated as an alternative to there being
nothing, and the body's interval covers both (estimate/mixture.py).

How far it trails: half the log of how much sharper the recordings know its amount than the prior does, and
the log of the number of hypotheses that are as likely as it is beforehand, less what it gains. What every
rig has some of, as all cables weigh and all bodies take air along, is no chance among many: of that only the
amount is asked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rig_identification.estimate.identify import Ideal
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.findings import rival
from rig_identification.mismatch.screen import Promise
from rig_identification.mismatch.trial import Trial, attempt, finished, log_evidence

Notify = Callable[[str, float], None]

#: Nats by which an explanation may trail and still be stated, and how many are, at most ("not worth more than
#: a bare mention" up to one nat, "positive" up to three: Kass and Raftery, J. Am. Stat. Assoc. 90, 1995).
TIED, STATED = 3.0, 2


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
    nothing = log_evidence(evaluation)

    def chance(candidate: Candidate) -> float:
        return 0.0 if candidate.everywhere else float(np.log(count))

    def trails(promise: Promise) -> float:
        return (promise.charge or 0.0) + chance(promise.candidate) - promise.gain

    close = [p for p in promises if p.charge is not None and trails(p) < TIED]
    stated: list[tuple[float, Trial]] = []
    for promise in sorted(close, key=trails)[:STATED]:
        notify(f"search: {promise.candidate.label}, which may be there", 0.5)
        begun = attempt(problem, evaluation, promise, budget)
        ended = None if begun is None else finished(begun, budget)
        if ended is None or not ended.settled:
            continue
        gap = nothing + chance(promise.candidate) - ended.evidence
        if gap < TIED:
            stated.append((max(gap, 0.0), ended))
    if not stated:
        return None
    stated.sort(key=lambda s: s[0])
    named = " and ".join(dict.fromkeys(trial.candidate.effect for _, trial in stated))
    mismatch = replace(
        ideal.mismatch,
        explanation=f"{ideal.mismatch.explanation} Whether there is {named} they neither show nor exclude.",
        alternatives=tuple(rival(t, gap) for gap, t in stated),
    )
    bodies = tuple((gap, inertial_estimate(t.problem, t.evaluation)) for gap, t in stated)
    return Explained(ideal.fitted, mismatch, ideal, bodies=bodies)
