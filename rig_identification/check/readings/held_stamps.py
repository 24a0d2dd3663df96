"""When the samples were taken of a device that is published more often than it measures.

A value is stamped when it is published first, up to one message interval after it was measured. A device has
a steady clock of its own: its values lie on a straight line of time, but for those that were never published.
The line from which all stamps are late by an interval at most is where they were measured, up to a
constant.

What sets the pace of that clock is a crystal, and it is one in all recordings. How late stamps are changes
slowly, as the two clocks slip, so that a film of T seconds tells the pace to within an interval over T: some
parts in ten thousand. Two films told apart so disagree on a swing's period by more than the swing itself
leaves open. So all recordings tell one pace together, unless they contradict each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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


def steady(recorded: Sequence[Stamps], interval: float) -> list[Stamps]:
    """Stamps of each recording on the device's own line of time; as they are where no line passes close by.

    Parameters
    ----------
    recorded : sequence of (n,) int64
        When each value was published first, ascending, of each recording.
    interval : float
        Between two messages of the topic, s.
    """
    breaks = [_breaks(stamps, interval) for stamps in recorded]
    lines = [
        None if lost is None else _line_of(lost, _seconds(stamps))
        for stamps, lost in zip(recorded, breaks, strict=True)
    ]
    common = _common([line for line in lines if line is not None], interval)
    out = []
    for stamps, line in zip(recorded, lines, strict=True):
        if line is None:
            out.append(stamps)
            continue
        # What is late by half an interval on average stays so: a constant is the clocks' business
        on_line = line.at(line.pace if common is None else common)
        out.append(np.asarray(stamps[0] + np.rint(1e9 * on_line).astype(np.int64)))
    return out


@dataclass(frozen=True)
class _Line:
    """A recording's least-squares line through its stamps."""

    numbers: Array  # (n,) of each value as the device counts, about their mean
    middle: float  # s, mean stamp
    pace: float  # s from one value to the next

    def at(self, pace: float) -> Array:
        """(n,) s, the line through the middle at another pace."""
        return np.asarray(self.middle + pace * self.numbers)


def _line_of(breaks: list[int], seconds: Array) -> _Line:
    numbers = _numbers(breaks, seconds.size)
    numbers = numbers - np.mean(numbers)
    return _Line(numbers, float(np.mean(seconds)), float(numbers @ seconds) / float(numbers @ numbers))


def _common(lines: Sequence[_Line], interval: float) -> float | None:
    """The pace (s) that recordings tell together; None where they contradict each other."""
    if not lines:
        return None
    pace = np.array([line.pace for line in lines])
    # Late by an interval at one end and by nothing at the other
    off = np.array([interval / float(np.ptp(line.numbers)) for line in lines])
    mean = float(np.average(pace, weights=1.0 / off**2))
    return mean if np.all(np.abs(pace - mean) <= off) else None


def _seconds(stamp_ns: Stamps) -> Array:
    return np.asarray((stamp_ns - stamp_ns[0]) / 1e9)


def _breaks(stamp_ns: Stamps, interval: float) -> list[int] | None:
    """Where values were never published; None where no line passes close by all stamps."""
    count = len(stamp_ns)
    if count < 2 * FEWEST or interval <= 0.0:
        return None
    seconds = _seconds(stamp_ns)
    breaks: list[int] = []
    best = _off([], seconds)
    while (len(breaks) + 1) * PUBLISHED < count:
        more = [*breaks, _next_break(breaks, seconds)]
        off = _off(more, seconds)
        if off > LESS * best:
            break
        breaks, best = more, off
    return breaks if best <= ABOUT * interval else None


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
