"""The decision: which hypothesis about the set-up, if any, makes the session hang together.

One at a time: the best hypothesis is accepted if it gains more nats than its price, its readings are put
right, and the rest is asked again. The price is the same for all: the prior odds of any one fault, the
size of its family, and what its free numbers cost.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.check.consistency import faults
from rig_identification.check.consistency.evidence import Account, Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis
from rig_identification.check.consistency.reduced import reduced
from rig_identification.check.found import Found, modules_with
from rig_identification.examination import SetupFault
from rig_identification.raw import RawSession

#: Nats of the prior odds against any one kind of fault in a session: one in ten thousand.
PRIOR = float(np.log(1e4))
#: Nats that a fitted number costs: afterwards it is known to a part in 150 of what it might have been.
NUMBER = float(np.log(150.0))
#: Hypotheses within so many nats of the best are evaluated thoroughly, at most ``FINALISTS``.
NEAR, FINALISTS = 12.0, 4
#: Two that differ by less explain the session alike: e^3 is twenty to one.
TIE = 3.0
#: Faults that one session may have.
ROUNDS = 8


@dataclass(frozen=True)
class Weighed:
    """A hypothesis and what it gains beyond its price."""

    hypothesis: Hypothesis
    account: Account
    gain: float  # nats by which the session hangs together better
    net: float  # gain less price


@dataclass(frozen=True)
class Verdict:
    """Faults in the order of their evidence, and how what is left agrees at rest."""

    found: tuple[Found, ...]
    evidence: Evidence | None  # of the session without them; None where nothing can be compared


def judged(session: RawSession) -> Verdict:
    """Find what channels show against each other and against the description."""
    out: list[Found] = []
    evidence = _evidence(session)
    for _ in range(ROUNDS):
        if evidence is None:
            return Verdict(tuple(out), None)
        weighed = _weighed(evidence)
        for best in weighed:
            if best.net <= 0.0:
                return Verdict(tuple(out), evidence)
            corrected = _changes(best).raw(session)
            after = _evidence(corrected)
            if _holds(best, evidence, after):
                break
        else:
            return Verdict(tuple(out), evidence)
        told = _told(best, [w for w in weighed if w is not best])
        if any(_same(told, found.fault) for found in out):
            return Verdict(tuple(out), evidence)
        session, evidence = corrected, after
        out.append(Found(told, session))
    return Verdict(tuple(out), None)


def _evidence(session: RawSession) -> Evidence | None:
    small = reduced(session)
    return Evidence(small) if small.recordings and small.at_rest else None


def _holds(best: Weighed, before: Evidence, after: Evidence | None) -> bool:
    """Whether the session hangs together better by the hypothesis's price once its readings are put right.

    A belief that is given up lets the numbers of each part of the evidence go their own way: a gain that rest
    leaves at nothing and forces bend to their noise is no fault.
    """
    return after is None or before.plain.cost - after.plain.cost > best.gain - best.net


def _same(one: SetupFault, other: SetupFault) -> bool:
    """Whether a fault is told again: what its correction leaves is no second one."""
    return one.effect == other.effect and one.where == other.where


def _changes(best: Weighed) -> Change:
    fitted = best.hypothesis.fitted
    if fitted is not None and best.account.rest is not None:
        return fitted(best.account.rest)
    return best.hypothesis.change


def proposals(evidence: Evidence) -> Iterator[Hypothesis]:
    """Hypotheses of every file in ``faults`` that could gain their price."""
    for family in modules_with(faults, "hypotheses"):
        for hypothesis in family.hypotheses(evidence):
            if evidence.bound(hypothesis.about) > PRIOR:
                yield hypothesis


def _weighed(evidence: Evidence) -> list[Weighed]:
    """The best hypotheses, evaluated thoroughly, best first."""
    quick = _compared(evidence)
    close = [w for w in quick[:FINALISTS] if w.net > quick[0].net - NEAR and w.net > -NEAR]
    final = [_weigh(evidence, w.hypothesis, thorough=True) for w in close]
    plain = min((evidence.plain_beside(w.account) for w in final), default=evidence.plain.cost)
    lost = evidence.plain.cost - plain
    return sorted((replace(w, gain=w.gain - lost, net=w.net - lost) for w in final), key=lambda w: -w.net)


def _compared(evidence: Evidence) -> list[Weighed]:
    """Hypotheses weighed to first order, best first, but those that cannot come near the best or the price.

    Those that might gain most come first, and among them those that take least time.
    """
    out: list[Weighed] = []
    floor = -NEAR
    hopes = [(evidence.bound(h.about) - _price(h), h) for h in proposals(evidence)]
    for hope, hypothesis in sorted(hopes, key=lambda pair: (pair[1].fresh, -pair[0])):
        if hope > floor:
            out.append(_weigh(evidence, hypothesis, thorough=False, floor=floor))
            floor = max(floor, out[-1].net - NEAR)
    return sorted(out, key=lambda w: -w.net)


def _price(hypothesis: Hypothesis) -> float:
    """Nats that a hypothesis costs before any reading is looked at."""
    return PRIOR + float(np.log(hypothesis.variants)) + NUMBER * hypothesis.free + hypothesis.penalty


def _weigh(evidence: Evidence, hypothesis: Hypothesis, thorough: bool, floor: float = -np.inf) -> Weighed:
    """floor: net nats below which the account does not matter."""
    price = _price(hypothesis)
    account = evidence.judged(hypothesis, thorough, evidence.plain.cost - price - floor)
    if account.rest is None:
        return Weighed(hypothesis, account, -np.inf, -np.inf)
    gain = evidence.plain.cost - account.cost
    return Weighed(hypothesis, account, gain, gain - price)


def _told(best: Weighed, others: list[Weighed]) -> SetupFault:
    ties = []
    for other in others:
        gap = best.net - other.net
        if gap < TIE and other.net > 0.0:
            told = other.hypothesis.describe(other.account.rest)
            ties.append(
                {
                    "effect": told.effect,
                    "where": told.where,
                    "statement": told.statement,
                    "log_likelihood_gap": gap,
                }
            )
    told = best.hypothesis.describe(best.account.rest)
    return replace(told, gain=best.gain, alternatives=tuple(ties))
