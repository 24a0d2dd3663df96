"""Do sessions agree on one body, with what they share taken into account.

To first order the error of session i is, with its posterior covariance C_i over body and doubts (the doubts p
in units of their tolerances, prior N(0, 1)),

    e_i = C_i (noise_i - p_i),    Cov(noise_i) = the information of its recordings alone,

so that its own covariance is C_i, and with a prior correlation R_ij = E[p_i p_j'] of the doubts of two
sessions (ties.py)

    Cov(x_i, x_j) = C_i[x, p] R_ij C_j[p, x].

A weighing with std s that both rest on adds C_i[x, m] C_j[m, x] / s^2. What an answer's covariance holds
beyond its fit's own (rivals, traces) is taken as independent. Where it is not, the same explanations apply to
both sessions, their errors are alike, and differences are smaller than is allowed for here.

If all sessions saw one body, Q = r' V^-1 r of the residuals about the generalised least-squares mean is
chi-square distributed. Its degrees of freedom are the numbers of all sessions less those of the body (Rao,
"Linear statistical inference and its applications", 1973, section 4a).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rig_identification.model.definite import definite
from rig_identification.result import ELEMENTS
from rig_identification.several.session_result import SessionResult
from rig_identification.several.ties import Sharing, Ties, ties

Array = NDArray[np.float64]

#: Share of sets of sessions of one body that are said to disagree: one in a hundred.
LEVEL = 0.01


@dataclass(frozen=True)
class Test:
    """A chi-square with its degrees of freedom and how likely a larger one is by chance."""

    chi_square: float
    freedom: int
    p: float  # 1 where nothing is tested


@dataclass(frozen=True)
class Comparison:
    """Whether sessions agree, number by number and together."""

    results: tuple[SessionResult, ...]
    rigs: tuple[str, ...]  # of each session
    shared: int  # doubts that at least two sessions have in common
    together: Test
    numbers: dict[str, Test]  # of those that at least two sessions determine
    sessions: dict[str, Test]  # each against all others; of two sessions none
    mean: dict[str, tuple[float, float]]  # number -> value and std, of its own values alone
    p: float  # of the verdict
    level: float

    @property
    def agree(self) -> bool:
        """Whether nothing disagrees at the level asked for."""
        return self.p >= self.level

    @property
    def disagreeing(self) -> tuple[str, ...]:
        """Numbers that disagree by themselves, most surely first; none where the sessions agree."""
        if self.agree:
            return ()
        limit = self.level / (2.0 * max(len(self.numbers), 1))
        found = sorted((test.p, name) for name, test in self.numbers.items() if test.p < limit)
        return tuple(name for _, name in found)


def compare(
    results: Sequence[SessionResult], sharing: Sharing | None = None, level: float = LEVEL
) -> Comparison:
    """Test whether the sessions saw one body.

    The verdict takes the smaller of two p values: that of all numbers together, and the smallest one of a
    single number times their count. It is doubled (Bonferroni): at most ``level`` of the sets that agree are
    said to disagree, however the tests hang together.
    """
    found = ties(results, sharing)
    covariance = joint_covariance(results, found)
    together = _tested(results, covariance, tuple(range(len(results))))
    numbers = {name: _number(results, covariance, k)[0] for k, name in enumerate(ELEMENTS)}
    numbers = {name: test for name, test in numbers.items() if test.freedom}
    single = min((test.p for test in numbers.values()), default=1.0) * len(numbers)
    means = (_number(results, covariance, k)[1] for k in range(10))
    return Comparison(
        tuple(results),
        found.rigs,
        _count_shared(found),
        together,
        numbers,
        _sessions(results, covariance, together),
        {name: mean for name, mean in zip(ELEMENTS, means, strict=True) if mean is not None},
        float(min(1.0, 2.0 * min(together.p, single))) if numbers else 1.0,
        level,
    )


def joint_covariance(results: Sequence[SessionResult], found: Ties) -> Array:
    """(10 N, 10 N) covariance of all sessions' ten numbers, given one body."""
    count = len(results)
    out = np.zeros((10 * count, 10 * count))
    for i, one in enumerate(results):
        block = slice(10 * i, 10 * i + 10)
        own = np.zeros((10, 10)) if one.joint is None else one.posterior[:10, :10]
        out[block, block] = own + one.excess
        for j in range(i):
            across = _across(one, results[j], found.correlation(i, j))
            out[block, 10 * j : 10 * j + 10] = across
            out[10 * j : 10 * j + 10, block] = across.T
    return out


def _across(one: SessionResult, other: SessionResult, correlation: Array) -> Array:
    """(10, 10) covariance of two sessions' ten numbers."""
    if one.joint is None or other.joint is None:
        return np.zeros((10, 10))
    first, second = one.posterior[:10], other.posterior[:10]
    out = first[:, 10:] @ correlation @ second[:, 10:].T
    scale = one.joint.weighing
    if scale is not None and scale == other.joint.weighing:
        # The same reading to the digit is one weighing; two would differ by their noise
        out = out + np.outer(first[:, 0], second[:, 0]) / scale.std**2
    return np.asarray(out)


def _count_shared(found: Ties) -> int:
    held = [
        {k for k, a in zip(*pair, strict=True) if a > 0.0}
        for pair in zip(found.keys, found.shared, strict=True)
    ]
    return sum(1 for key in set().union(*held) if sum(key in one for one in held) > 1)


def _tested(results: Sequence[SessionResult], covariance: Array, chosen: tuple[int, ...]) -> Test:
    """All numbers of the chosen sessions together."""
    rows = [(i, k) for i in chosen for k in range(10) if results[i].observed[k]]
    return _against_mean(results, covariance, rows)[0]


def _number(
    results: Sequence[SessionResult], covariance: Array, k: int
) -> tuple[Test, tuple[float, float] | None]:
    """One number in all sessions that determine it, and its mean with std."""
    rows = [(i, k) for i in range(len(results)) if results[i].observed[k]]
    test, mean, std = _against_mean(results, covariance, rows)
    return test, (float(mean[0]), float(std[0])) if rows else None


def _sessions(results: Sequence[SessionResult], covariance: Array, together: Test) -> dict[str, Test]:
    """By how much chi-square falls without each session: what it differs from all others by."""
    if len(results) < 3:
        return {}
    out = {}
    for i, result in enumerate(results):
        others = _tested(results, covariance, tuple(j for j in range(len(results)) if j != i))
        out[result.name] = _test(
            max(0.0, together.chi_square - others.chi_square), together.freedom - others.freedom
        )
    return out


def _against_mean(
    results: Sequence[SessionResult], covariance: Array, rows: list[tuple[int, int]]
) -> tuple[Test, Array, Array]:
    """Chi-square of the values ``rows`` (session, element) about their mean; mean and std of each element."""
    elements = sorted({k for _, k in rows})
    if not rows:
        return _test(0.0, 0), np.zeros(0), np.zeros(0)
    index = [10 * i + k for i, k in rows]
    value = np.array([results[i].values[k] for i, k in rows])
    scale = np.sqrt(np.diag(covariance)[index])
    design = np.array([[float(k == e) for e in elements] for _, k in rows]) / scale[:, None]
    factor = np.linalg.cholesky(definite(covariance[np.ix_(index, index)] / np.outer(scale, scale)))
    white, columns = np.linalg.solve(factor, value / scale), np.linalg.solve(factor, design)
    mean, *_ = np.linalg.lstsq(columns, white, rcond=None)
    left = white - columns @ mean
    inverse = np.linalg.inv(np.linalg.qr(columns, mode="r"))
    return (
        _test(float(left @ left), len(rows) - len(elements)),
        mean,
        np.sqrt(np.sum(inverse**2, axis=1)),
    )


def _test(chi_square: float, freedom: int) -> Test:
    p = float(chi2.sf(chi_square, freedom)) if freedom else 1.0
    return Test(chi_square, freedom, p)
