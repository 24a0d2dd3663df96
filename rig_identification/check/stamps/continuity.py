"""Jumps of a stream's stamps, and what it is worth to explain them by one rule."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.stamps.regular import mean_interval, seconds, usual_interval
from rig_identification.check.stamps.streams import SECOND
from rig_identification.raw import Stamps

#: Intervals of sampling that are no jump: losses of a sample or two and ordinary jitter.
_ORDINARY = 3.0
#: s; messages that wait in queues are no jumps either.
_WAIT = 0.005


def jumps(stamps: Stamps, interval: float) -> NDArray[np.bool_]:
    """(n - 1,) steps of the stamps that lead back, or on by more than a few intervals (s)."""
    steps = np.diff(stamps) / SECOND
    return np.asarray((steps < -0.5 * interval) | (steps > _ORDINARY * interval + _WAIT))


def gain_of(stamps: Stamps, mended: Stamps) -> float:
    """Nats by which a rule that turns ``stamps`` into ``mended`` explains a stream.

    Each jump costs its place, one of n, and its size, one of the stream's length over the sampling interval.
    The rule pays for the jumps that it leaves, and gains nothing where it leaves more than a quarter of them.
    """
    times = seconds(mended)
    interval = usual_interval(times)
    if interval <= 0.0 or mean_interval(times) <= 0.0:
        return 0.0
    before, after = (int(np.count_nonzero(jumps(s, interval))) for s in (stamps, mended))
    if after > before / 4:
        return 0.0
    return (before - after) * 2.0 * math.log(len(stamps))
