"""When the samples were taken of a device that is published more often than it measures.

A value is stamped when it is published first, up to one message interval after it was measured. A device has
a steady clock of its own: its values lie on a straight line of time, but for those that were never published.
The line from which all stamps are late by an interval at most is where they were measured, up to a
constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

#: Root mean square (message intervals) of stamps about the device's own line: late by anything up to an
#: interval they have 1 / sqrt(12) = 0.29 of it, and a publisher that is late itself as much again.
ABOUT = 0.5
#: What a value that was never published has to take off that.
LESS = 0.9
#: Values that were never published, at most one in so many: a line with more breaks is none.
PUBLISHED = 40
#: Samples that tell the line between two breaks, at least.
FEWEST = 8


def steady(stamp_ns: Stamps, interval: float) -> Stamps:
    """Stamps on the device's own line of time; as they are where no line passes close by all of them.

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
    best = _off([], seconds)
    while (len(breaks) + 1) * PUBLISHED < count:
        more = [*breaks, _next_break(breaks, seconds)]
        off = _off(more, seconds)
        if off > LESS * best:
            break
        breaks, best = more, off
    if best > ABOUT * interval:
        return stamp_ns
    # What is late by half an interval on average stays so: a constant is the clocks' business
    return np.asarray(stamp_ns[0] + np.rint(1e9 * _line(breaks, seconds)).astype(np.int64))


def _off(breaks: list[int], seconds: Array) -> float:
    """Root mean square distance (s) of all stamps from their line."""
    return float(np.sqrt(np.mean((seconds - _line(breaks, seconds)) ** 2)))


def _numbers(breaks: list[int], count: int) -> Array:
    """(n,) the number of each value as the device counts, with one that was never published at each break."""
    k = np.arange(count)
    return k + sum((np.greater_equal(k, b).astype(float) for b in breaks), np.zeros(count))


def _line(breaks: list[int], seconds: Array) -> Array:
    """(n,) least-squares line through all stamps."""
    design = np.stack([np.ones(seconds.size), _numbers(breaks, seconds.size)], axis=1)
    return np.asarray(design @ np.linalg.lstsq(design, seconds, rcond=None)[0])


def _next_break(breaks: list[int], seconds: Array) -> int:
    """Where one more value that was never published brings the line nearest to all stamps.

    A line through (x, y) takes (sum x y)^2 / sum x^2 off y's squares, both about their means. With a break at
    b every x from there on is one larger, so that sums from b to the end tell it of all b at once.
    """
    count = seconds.size
    x, y = _numbers(breaks, count), seconds - np.mean(seconds)
    x = x - np.mean(x)
    after = count - np.arange(count)
    rest_x, rest_y = np.cumsum(x[::-1])[::-1], np.cumsum(y[::-1])[::-1]
    squares = x @ x + 2.0 * rest_x + after - after**2 / count
    taken = (x @ y + rest_y) ** 2 / squares
    candidates = [b for b in range(FEWEST, count - FEWEST) if b not in breaks]
    return candidates[int(np.argmax(taken[candidates]))]
