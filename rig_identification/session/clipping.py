"""Samples stuck at the end of a sensor's range."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Consecutive samples at exactly the extreme value that noise does not make.
_RUN = 4
#: Fewer distinct values than this: a resting or coarse signal, whose extreme is no limit.
_DISTINCT = 16
#: The crest of a sine in a coarse converter holds up to 1 / (sqrt(2) - 1) = 2.4 times the samples of the step
#: below.
_CREST = 4


def clipped_samples(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which samples are clipped, from the signal alone.

    A column is clipped where it holds its largest or smallest value exactly over several consecutive samples
    and that value is far more common than the next one. Exactly 0 is no limit: a slack cable and an idle
    exciter read it.

    Parameters
    ----------
    values : (n, width)
        Finite samples in order of time.

    Returns
    -------
    (n,) bool
    """
    clipped = np.zeros(len(values), bool)
    for column in values.T:
        levels, counts = np.unique(column, return_counts=True)
        if len(levels) < _DISTINCT:
            continue
        for level, count, below in ((levels[0], counts[0], counts[1]), (levels[-1], counts[-1], counts[-2])):
            stuck = column == level
            if level != 0.0 and count >= max(_RUN, _CREST * below) and _longest_run(stuck) >= _RUN:
                clipped |= stuck
    return clipped


def _longest_run(flags: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return int(np.max(edges[1::2] - edges[::2], initial=0))
