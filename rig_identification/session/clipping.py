"""Samples stuck at the end of a sensor's range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

#: Consecutive samples at exactly the extreme value that noise does not make.
_RUN = 4
#: Fewer distinct values than this: a resting or coarse signal, whose extreme is no limit.
_DISTINCT = 16
#: The crest of a sine in a coarse converter holds up to 1 / (sqrt(2) - 1) = 2.4 times the samples of the step
#: below.
_CREST = 4


@dataclass(frozen=True)
class Limit:
    """An end of the range at which one column is stuck."""

    column: int
    value: float
    stuck: NDArray[np.bool_]  # (n,) which samples


def limits(values: NDArray[np.float64]) -> list[Limit]:
    """Ends of range at which the signal is stuck, from the signal alone.

    A column is clipped where it holds its largest or smallest value exactly over several consecutive samples
    and that value is far more common than the next one. Exactly 0 is no limit: a slack cable and an idle
    exciter read it.

    Parameters
    ----------
    values : (n, width)
        Finite samples in order of time.
    """
    out = []
    for k, column in enumerate(values.T):
        levels, counts = np.unique(column, return_counts=True)
        if len(levels) < _DISTINCT:
            continue
        for level, count, below in ((levels[0], counts[0], counts[1]), (levels[-1], counts[-1], counts[-2])):
            stuck = column == level
            if level != 0.0 and count >= max(_RUN, _CREST * below) and _longest_run(stuck) >= _RUN:
                out.append(Limit(k, float(level), stuck))
    return out


def clipped_samples(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) which samples are clipped in any column. values (n, width): see :func:`limits`."""
    clipped = np.zeros(len(values), bool)
    for limit in limits(values):
        clipped |= limit.stuck
    return clipped


def _longest_run(flags: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return int(np.max(edges[1::2] - edges[::2], initial=0))
