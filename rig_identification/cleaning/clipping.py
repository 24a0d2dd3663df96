"""Samples stuck at the end of a sensor's range, and what lies so near that noise decides whether it is.

Leaving out what is stuck alone would bias what is left: of samples within reach of the limit those whose
noise points outwards are gone, and what stays reads like a sensor whose scale is too small. So all is left
out where the signal itself comes within reach, whatever its noise did to the single sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

#: Consecutive samples at exactly the extreme value that noise does not make.
_RUN = 4
#: Fewer distinct values than this: a resting or coarse signal, whose extreme is no limit.
_DISTINCT = 16
#: The crest of a sine in a coarse converter holds up to 1 / (sqrt(2) - 1) = 2.4 times the samples of the step
#: below. Where each step holds one or two samples chance makes more of it: it is held against the fullest of
#: some steps.
_CREST, _BELOW = 4, 4
#: Samples whose mean is the signal itself, next to their noise.
_SMOOTHED = 5
#: Std of the noise within which of a limit it decides what is stuck.
_REACH = 3.0
#: A normal distribution's std over the median of its absolute values.
_MEDIAN_TO_STD = 1.4826


@dataclass(frozen=True)
class Limit:
    """An end of the range at which one column is stuck."""

    column: int
    value: float
    stuck: NDArray[np.bool_]  # (n,) which samples
    reached: NDArray[np.bool_]  # (n,) those, and all where the signal is within the noise's reach of it


def limits(values: NDArray[np.float64]) -> list[Limit]:
    """Ends of range at which the signal is stuck, from the signal alone.

    A column is clipped where it holds its largest or smallest value exactly over several consecutive samples
    and that value is far more common than any of the next ones. Exactly 0 is no limit: a slack cable and an
    idle exciter read it.

    Parameters
    ----------
    values : (n, width)
        Samples in order of time; NaN: not measured.
    """
    out = []
    for k, whole in enumerate(values.T):
        known = np.isfinite(whole)
        column = whole[known]
        levels, counts = np.unique(column, return_counts=True)
        if len(levels) < _DISTINCT:
            continue
        ends = ((levels[0], counts[: _BELOW + 1]), (levels[-1], counts[: -_BELOW - 2 : -1]))
        for level, (count, *others) in ends:
            below = max(others)
            stuck = column == level
            if level != 0.0 and count >= max(_RUN, _CREST * below) and _longest_run(stuck) >= _RUN:
                reached = stuck | _within_reach(column, float(level), stuck, upper=level == levels[-1])
                out.append(Limit(k, float(level), _among(known, stuck), _among(known, reached)))
    return out


def _among(known: NDArray[np.bool_], flags: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) flags of the known samples among all of them."""
    out = np.zeros(known.size, bool)
    out[known] = flags
    return out


def clipped_samples(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) which samples are clipped in any column. values (n, width): see :func:`limits`."""
    clipped = np.zeros(len(values), bool)
    for limit in limits(values):
        clipped |= limit.stuck
    return clipped


def _within_reach(
    column: NDArray[np.float64], level: float, stuck: NDArray[np.bool_], *, upper: bool
) -> NDArray[np.bool_]:
    """Where the mean over a few samples comes within a few std of the noise of ``level``."""
    free = ~(stuck[:-2] | stuck[1:-1] | stuck[2:])
    bends = np.diff(column, 2)[free]
    # White noise has a second difference of variance 1 + 4 + 1; the signal's own makes the reach wider
    noise = _MEDIAN_TO_STD * float(np.median(np.abs(bends))) / np.sqrt(6.0) if bends.size else 0.0
    mean = uniform_filter1d(column, _SMOOTHED, mode="nearest")
    near = mean >= level - _REACH * noise if upper else mean <= level + _REACH * noise
    return np.asarray(near)


def _longest_run(flags: NDArray[np.bool_]) -> int:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return int(np.max(edges[1::2] - edges[::2], initial=0))
