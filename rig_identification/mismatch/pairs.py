"""Two small errors at once, where either alone is not what is likeliest.

Near the noise first order can be trusted, and of two effects at once the likelier single hypothesis is
often a third one: nine numbers of a hose bend to a heavy cable beside a cell's zero, of two numbers. So pairs
are screened as single ones are. A pair costs what noise gives both of them; where it is worth more than any
single hypothesis even so, and its fit keeps that, the search begins with the one that says more alone.
Where a single one that is fitted slowly promised most, it is fitted as well, and evidence decides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.first_fits import BEATEN
from rig_identification.mismatch.hypotheses import compatible, needed_gain, net_gain
from rig_identification.mismatch.screen import Promise, promises_of, together
from rig_identification.mismatch.trial import Trial, attempt, beyond_doubt, fitted_to_its_end, ordinary_errors

Notify = Callable[[str], None]

#: Hypotheses that promise most, of which pairs are made.
PAIRED = 24


@dataclass(frozen=True)
class Led:
    """The hypothesis of a pair that says more alone, fitted to its end."""

    first: Trial
    leads: bool  # whether the fit of both keeps what the pair promised
    instead: Trial | None = None  # one effect that is as likely as both


def first_of_two(
    problem: Problem,
    evaluation: Evaluation,
    promises: list[Promise],
    count: int,
    ahead: float,
    limit: float,
    notify: Notify,
    budget: Budget,
) -> Led | None:
    """The one of a pair to begin with; None where no pair promises more than any single hypothesis.

    promises: of all hypotheses about ``evaluation``, best first; count: of all hypotheses. ahead: nats by
    which a pair has to be worth more. limit: of ordinary errors, in tolerances.
    """
    single = max(promises, key=lambda p: net_gain(p, count), default=None)
    alone = 0.0 if single is None else net_gain(single, count)
    likely = {p.candidate.label: p for p in promises if not p.candidate.slow and p.candidate.settle is None}
    plain = sorted(likely.values(), key=lambda p: -net_gain(p, count))[:PAIRED]
    pairs = [
        (a.candidate, b.candidate)
        for a, b in combinations(plain, 2)
        if compatible([b.candidate], [a.candidate])
    ]
    worth = [
        gain - _cost(pair, count)
        for pair, gain in zip(pairs, together(problem, evaluation, pairs), strict=False)
    ]
    if not worth or max(worth) < max(alone, 0.0) + ahead:
        return None
    one, other = pairs[worth.index(max(worth))]
    notify(f"{one.label} and {other.label}")
    first = fitted_to_its_end(problem, evaluation, likely[one.label], budget)
    if first is None:
        return None
    (promise,) = promises_of(first.problem, first.evaluation, [other])
    second = attempt(first.problem, first.evaluation, promise, budget)
    if second is None:
        return Led(first, False)
    ordinary = ordinary_errors(problem)
    taken = evaluation.cost - second.evaluation.cost
    kept = taken - _cost((one, other), count) > max(alone, 0.0) + ahead
    # What the first took away by itself, further along than first order saw, needs no other one
    kept = kept and first.evaluation.cost - second.evaluation.cost > needed_gain(other, count)
    meant = all(beyond_doubt(replace(second, candidate=c), ordinary, limit) for c in (one, other))
    if not (kept and meant):
        return Led(first, False)
    slow = None
    # A hose that promises 75 nats of what two numbers take 240 of takes a minute to say so
    rival = single if single is not None and single.candidate.slow and single.gain > taken - BEATEN else None
    if rival is not None and alone > 0.0 and not budget.spent():
        notify(rival.candidate.label)
        slow = fitted_to_its_end(problem, evaluation, rival, budget)
    instead = slow is not None and slow.evidence > second.evidence - ahead
    return Led(first, not instead, slow if instead else None)


def _cost(pair: tuple[Candidate, Candidate], count: int) -> float:
    """Nats that noise gives a pair of ``count`` hypotheses."""
    return sum(needed_gain(c, count) for c in pair)
