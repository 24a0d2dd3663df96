"""What tells a step of a clock from a loss of samples: receipt, order, values and the recording's end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.stamps.common_clock import ORDINARY
from rig_identification.check.stamps.regular import usual_interval
from rig_identification.check.stamps.streams import SECOND, Stream

Array = NDArray[np.float64]

#: Samples on either side over which a step must last: a stall of 0.1 s at 500 Hz holds 50.
LASTING = 64
#: A message in twenty at most comes out of order: nats for each that would have to.
_OUT_OF_ORDER = math.log(20.0)
#: s; latencies may change by this much from one moment to the next.
_LATENCY_CHANGE = 0.005
#: s, std of the end of one stream against the others': a recorder stops for all at once, within an interval.
_END = 0.05
#: Moments at which the values' changes are taken to see how much is usual, and how many of them must be away
#: from jumps: three for each of some 20 columns.
_MOMENTS, _FEWEST = 300, 60
#: s; smaller steps are within what the fit takes for an offset between clocks, or a loss.
_SMALLEST = 0.02
#: s, and samples at least, on either side of a jump, from which a line is drawn to it.
_SIDE, _LEAST = 0.03, 3
#: Nats beyond which one source of evidence is not counted: its own model is not that sure.
_CAP = 100.0


@dataclass(frozen=True)
class Jump:
    """A place where a stream's stamps jump."""

    stream: Stream
    after: int  # index of the first message after it
    interval: float  # s, of sampling
    size: float  # s, by which the stamps lead on beyond an interval; negative: back


def lasting_jumps(stream: Stream) -> list[Jump]:
    """Places where the stamps lead back over two intervals, or on over five and 20 ms, and stay there.

    Smaller ones from 20 ms on are looked at where receive times do not follow them.
    """
    times = (stream.stamps - stream.stamps[0]) / SECOND
    steps = np.diff(times)
    interval = usual_interval(times)
    if interval <= 0.0:
        return []
    size = steps - interval
    large = (size < -2.0 * interval) & (steps < 0) | (size > max(5.0 * interval, _SMALLEST))
    small = ~large & (np.abs(size) > max(0.5 * interval, _SMALLEST))
    if small.any():
        small &= _not_received(stream, size)
    lag = min(LASTING, len(times) // 4)
    usual = float(np.median(times[lag:] - times[:-lag]))
    result = []
    for place in np.flatnonzero(large | small).tolist():
        first, last = max(place + 1 - lag, 0), min(place + 1, len(times) - lag)
        if last - first >= 10:
            across = float(np.median(times[first + lag : last + lag] - times[first:last])) - usual
            if small[place] or 0.5 < across / size[place] < 1.5:
                result.append(Jump(stream, place + 1, interval, float(size[place])))
    return result


def _not_received(stream: Stream, size: Array) -> NDArray[np.bool_]:
    """(n - 1,) where stamps jump against receive times, by the medians of five samples on either side."""
    if len(size) < 10 or not runs_along(stream):
        return np.zeros(len(size), bool)
    ahead = (stream.stamps - stream.received).astype(np.float64) / SECOND
    medians = np.median(np.lib.stride_tricks.sliding_window_view(ahead, 5), axis=1)
    change = np.zeros(len(size))
    change[4 : 4 + len(medians) - 5] = medians[5:] - medians[:-5]
    return np.asarray(np.abs(change - size) < 0.3 * np.abs(size))


def runs_along(stream: Stream) -> bool:
    """Whether receive times advance as the stamps do over a second or so, as a clock does."""
    lag = min(LASTING, len(stream.stamps) // 4)
    stamped, received = (np.median(t[lag:] - t[:-lag]) for t in (stream.stamps, stream.received))
    return bool(abs(received - stamped) < 0.1 * stamped)


def by_order(jump: Jump) -> float:
    """Nats for a step back: each message stamped before what came earlier would be out of order."""
    before = stamps_max(jump)
    after = jump.stream.stamps[jump.after :]
    return min(float(np.count_nonzero(after <= before)) * _OUT_OF_ORDER, _CAP) if jump.size < 0 else 0.0


def stamps_max(jump: Jump) -> int:
    """ns, the last stamp before the jump."""
    first = max(jump.after - LASTING, 0)
    return int(jump.stream.stamps[first : jump.after].max())


def by_receipt(jump: Jump) -> float:
    """Nats for a step of the stamps against receive times that go on; none where both step."""
    if not runs_along(jump.stream):
        return 0.0
    ahead = (jump.stream.stamps - jump.stream.received).astype(np.float64) / SECOND
    before, after = (
        ahead[max(jump.after - LASTING, 0) : jump.after], ahead[jump.after : jump.after + LASTING]
    )  # fmt: skip
    change = float(np.median(after) - np.median(before))
    spread = max(1.5 * float(np.median(np.abs(before - np.median(before)))), _LATENCY_CHANGE)
    seen, left = change / spread, (change - jump.size) / spread
    return float(np.clip(0.5 * (seen**2 - left**2), 0.0, _CAP))


def by_ends(jump: Jump, others: list[Stream]) -> float:
    """Nats for the stream's start and end to lie with those of streams without a jump, once it is undone."""
    if not others:
        return 0.0
    first, last = (int(np.median([int(f(s.stamps)) for s in others])) for f in (np.min, np.max))
    length = max((last - first) / SECOND, 1.0)
    start = (first - int(jump.stream.stamps.min())) / SECOND
    end = (int(jump.stream.stamps[jump.after :].max()) - last) / SECOND
    at_end = _usual_end(end - jump.size, _END, length) - _usual_end(end, _END, length)
    at_start = _usual_end(start - jump.size, ORDINARY / 5.0, length) - _usual_end(
        start, ORDINARY / 5.0, length
    )
    return float(np.clip(max(at_end, at_start), -_CAP, _CAP))


def _usual_end(outside: float, std: float, length: float) -> float:
    """Log density (1/s) of the time (s) by which a stream goes on outside of what the others cover.

    Mostly Gaussian. A stream in ten covers a part of the recording only; that it alone goes on takes a
    recorder that lost all others at once.
    """
    alone = 0.1 if outside < 0.0 else 1e-6
    gauss = math.exp(-0.5 * min((outside / std) ** 2, 1e3)) / (std * math.sqrt(2.0 * math.pi))
    return math.log(0.9 * gauss + alone / length)


def by_values(jumps: list[Jump], length: float) -> float:
    """Nats for the values to go on over a jump as from one sample to the next, not as over ``length`` (s).

    Lines through the samples on either side miss each other at the jump. By how much is Gaussian, with the
    covariances that it has elsewhere in the recording, with nothing and with ``length`` in between; what
    columns tell in common so counts once. At rest the two are alike and nothing is told. Over more than half
    of the recording values change as over half of it.
    """
    short, long, seen = [], [], []
    even = np.ones(_MOMENTS, bool)
    low = max(float(j.stream.stamps.min()) for j in jumps)
    high = min(float(j.stream.stamps.max()) for j in jumps)
    for jump in jumps:
        columns = jump.stream.channel.values
        columns = columns[:, np.isfinite(columns).all(axis=0)]
        side = max(_LEAST, round(_SIDE / jump.interval))
        size = min(round(length / jump.interval), len(columns) // 2 - side)
        if not columns.shape[1] or size < 1 or not side <= jump.after <= len(columns) - side:
            continue
        moments = np.linspace(low, high, _MOMENTS)
        where = np.clip(np.searchsorted(jump.stream.stamps, moments), side, len(columns) - size - side)
        for place in (where, where + size):
            even &= _even(jump, place, side)
        before = _drawn_on(columns, where, side, forwards=True)
        short.append(_drawn_on(columns, where, side, forwards=False) - before)
        long.append(_drawn_on(columns, where + size, side, forwards=False) - before)
        at = np.array([jump.after])
        ahead, back = (_drawn_on(columns, at, side, forwards=on)[0] for on in (True, False))
        seen.append(back - ahead)
    if not seen or np.count_nonzero(even) < _FEWEST:
        return 0.0
    laws = np.hstack(short)[even], np.hstack(long)[even]
    return float(np.clip(_ratio(*laws, np.concatenate(seen)), -_CAP, _CAP))


def _even(jump: Jump, where: NDArray[np.int64], side: int) -> NDArray[np.bool_]:
    """(k,) whether the samples about ``where`` follow each other, without a jump or a loss."""
    steps = np.diff(jump.stream.stamps, prepend=jump.stream.stamps[0]) / SECOND
    breaks = np.cumsum(np.abs(steps - jump.interval) > 2.0 * jump.interval)
    return np.asarray(breaks[where + side - 1] == breaks[where - side])


def _drawn_on(columns: Array, where: NDArray[np.int64], side: int, *, forwards: bool) -> Array:
    """(k, width) values half a sample before ``where``, by lines through what comes before, or from there."""
    offset = np.arange(-side, 0) if forwards else np.arange(side)
    line = np.linalg.pinv(np.column_stack((np.ones(side), offset + 0.5)))[0]
    return np.asarray(np.einsum("kiw,i->kw", columns[where[:, None] + offset], line))


def _ratio(short: Array, long: Array, seen: Array) -> float:
    """Log ratio of the likelihoods of a change ``seen`` under the laws of two samples of changes."""
    scale = np.std(long, axis=0)
    moving = scale > 0.0
    short, long, seen = (
        short[:, moving] / scale[moving],
        long[:, moving] / scale[moving],
        seen[moving] / scale[moving],
    )
    if not len(seen):
        return 0.0
    ridge = 1e-6 * np.eye(len(seen))
    near, far = (d.T @ d / len(d) + ridge for d in (short, long))
    volume = 0.5 * (np.linalg.slogdet(far)[1] - np.linalg.slogdet(near)[1])
    distance = 0.5 * (seen @ np.linalg.solve(near, seen) - seen @ np.linalg.solve(far, seen))
    return float(volume - distance)
