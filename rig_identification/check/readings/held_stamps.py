"""When the samples were taken of a device that is published more often than it measures.

A value is stamped when it is published first, up to one message interval after it was measured. A device has
a steady clock of its own: its values lie on a straight line of time, but for those that were never published.
The line that passes within an interval of all stamps is where they were measured, up to a constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

#: Message intervals from the lowest to the highest stamp about the line: one, and one more, by which a
#: publisher is late now and then and a line of least squares misses the middle of the narrowest band.
SPAN = 2.0
#: Values that were never published, at most one in so many: a line with more breaks is none.
PUBLISHED = 40
#: Samples that tell the line between two breaks, at least.
FEWEST = 8


def steady(stamp_ns: Stamps, interval: float) -> Stamps:
    """Stamps on the device's own line of time; as they are where no line passes within an interval of all.

    Parameters
    ----------
    stamp_ns : (n,) int64
        When each value was published first, ascending.
    interval : float
        Between two messages of the topic, s.
    """
    count = len(stamp_ns)
    if count < 2 * FEWEST or interval <= 0.0:
        return stamp_ns
    seconds = (stamp_ns - stamp_ns[0]) / 1e9
    breaks: list[int] = []
    while True:
        line = _line(breaks, seconds)
        if np.ptp(seconds - line) <= SPAN * interval:
            # What is late by half an interval on average stays so: a constant is the clocks' business
            return stamp_ns[0] + np.rint(1e9 * line).astype(np.int64)
        if (len(breaks) + 1) * PUBLISHED > count:
            return stamp_ns
        breaks.append(_next_break(breaks, seconds))


def _line(breaks: list[int], seconds: Array) -> Array:
    """(n,) least-squares line through all stamps with a step at each break."""
    k = np.arange(seconds.size)
    columns = [np.ones(seconds.size), k.astype(float), *((k >= b).astype(float) for b in breaks)]
    design = np.stack(columns, axis=1)
    return np.asarray(design @ np.linalg.lstsq(design, seconds, rcond=None)[0])


def _next_break(breaks: list[int], seconds: Array) -> int:
    """Where one more step brings the line nearest to all stamps."""
    candidates = [b for b in range(FEWEST, seconds.size - FEWEST) if b not in breaks]
    left = [float(np.sum((seconds - _line([*breaks, b], seconds)) ** 2)) for b in candidates]
    return candidates[int(np.argmin(left))]
