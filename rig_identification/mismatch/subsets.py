"""Which of many small effects are there together: every subset at once, to second order.

About one fit, with all candidates' numbers t free beside everything else, the cost is quadratic: at its
lowest point t* it is c*, and C is the covariance of t there. A subset leaves some of them, B, out and holds
them at zero. With everything else at its best the cost is then c* + 1/2 t*_B' C_BB^-1 t*_B, the information's
log determinant is log det H + log det C_BB, and what is kept, A, lies at t*_A - C_AB C_BB^-1 t*_B. So one
linearisation gives Laplace's log evidence of all 2^n subsets (the prior's precision is 1 in these units).
Adding effects one by one cannot: the first one takes what two others explain better together, and then
nothing asks for them.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Part of a number's variance, and variance in units of its prior's, below which it is rounding: where
#: motions part, as at dry hinges that stop them, some numbers are known to more digits than there are.
FLOOR = 1e-9


def best_subset(
    best: Array,
    covariance: Array,
    groups: list[list[int]],
    positive: list[bool],
    penalties: list[float],
    apart: list[tuple[int, int]] | None = None,
) -> tuple[int, ...]:
    """Groups of numbers (effects) that belong into the model.

    best: (n,) where the cost is lowest, in units of the prior's std; covariance: (n, n) there; groups: which
    of these numbers are each effect's (one may be of several); positive: whether the first of them cannot be
    negative; penalties: nats that an effect has to gain beyond its evidence; apart: pairs of effects of which
    one alone can be.
    Returns the kept effects' places in ``groups``.
    """
    chosen: tuple[int, ...] = ()
    highest = -np.inf
    for count in range(len(groups) + 1):
        for kept in combinations(range(len(groups)), count):
            if any(a in kept and b in kept for a, b in apart or ()):
                continue
            score = _score(best, covariance, groups, positive, kept) - sum(penalties[k] for k in kept)
            if score > highest:
                chosen, highest = kept, score
    return chosen


def gains_alone(
    best: Array, covariance: Array, groups: list[list[int]], positive: list[bool]
) -> tuple[float, ...]:
    """Log evidence that each group of numbers gains by itself over none of them. Arguments as above."""
    none = _score(best, covariance, groups, positive, ())
    return tuple(_score(best, covariance, groups, positive, (k,)) - none for k in range(len(groups)))


def _score(
    best: Array, covariance: Array, groups: list[list[int]], positive: list[bool], kept: tuple[int, ...]
) -> float:
    """Log evidence of a subset less a constant; minus infinity where a positive number would not be."""
    inside = {i for k in kept for i in groups[k]}
    out = sorted({i for group in groups for i in group} - inside)
    value, score = best, 0.0
    if out:
        held = covariance[np.ix_(out, out)] + np.diag(FLOOR * (np.diag(covariance)[out] + FLOOR))
        pull = np.linalg.solve(held, best[out])
        value = best - covariance[:, out] @ pull
        score = -0.5 * float(best[out] @ pull) - 0.5 * float(np.linalg.slogdet(held)[1])
    absurd = any(positive[k] and value[groups[k][0]] <= 0.0 for k in kept)
    return -np.inf if absurd else score
