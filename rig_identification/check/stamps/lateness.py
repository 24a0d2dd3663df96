"""Stamps taken after the measurement: on arrival at the host, or when a driver hands several samples over."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.stamps.evenly import measured_evenly
from rig_identification.check.stamps.polling import lattice
from rig_identification.check.stamps.regular import (
    TOGETHER,
    Grid,
    envelope_grid,
    lossless_interval,
    mean_interval,
    rate_line,
    seconds,
)
from rig_identification.check.stamps.streams import SECOND, Stream
from rig_identification.raw import Stamps

Array = NDArray[np.float64]

#: Part of the intervals below a tenth of the sampling interval that is ordinary: jitter of a fifth of an
#: interval makes 0.1 %, an even one that nearly swaps samples 0.2 %, a message in twenty comes out of order.
_ORDINARY_TOGETHER = 0.06
#: Part of the deviations, the largest, whose sides are counted.
_LARGEST = 0.2
#: Samples at the end of a stream that may lie in the last block of an envelope.
_TAIL = 128
#: From this agreement of phases on, deviations are told apart from those by an interval more.
_AGREEING = 0.1


@dataclass(frozen=True)
class Late:
    """A stream whose stamps are late by more than ordinary jitter."""

    grid: Grid
    stamps: Stamps  # (n,) ns, of measurement as the grid has it, up to a constant delay
    gain: float  # nats
    together: int  # intervals shorter than a tenth of the sampling interval
    handover: float  # s, median time between the others
    polled: bool  # samples come together, at times as even as those of a driver that polls
    std: float  # s, of the delay that stays unknown


def late(stream: Stream, tolerance: float) -> Late | None:
    """How late the stamps of a stream are, None where they are as a device would give them.

    tolerance: s, doubt of a device's clock; jitter below it does no harm and is nobody's fault.
    """
    times, fresh = _fresh(stream)
    mean = mean_interval(times)
    if mean <= 0.0 or float(np.ptp(stream.stamps)) / SECOND > 3.0 * mean * len(times):
        return None  # stamps that jump are another kind's
    steps = np.diff(times)
    short = steps < TOGETHER * mean
    # Even steps are no jitter, unless most are short: of bursts longer than ten samples few steps lie between
    even = float(np.quantile(steps, 0.9) - np.quantile(steps, 0.1)) < tolerance
    if even and np.mean(short) <= _ORDINARY_TOGETHER:
        return None
    gain = len(steps) * _relative_entropy(float(np.mean(short)), _ORDINARY_TOGETHER)
    rounding = resolution(stream.stamps)
    if gain > 0.0 and rounding > 0.3 * mean and np.median(steps[~short]) < 1.5 * max(mean, rounding):
        gain = 0.0  # rounding puts them together, not a driver
    interval = lossless_interval(times)
    turns, agreement = 0.0 * times, 1.0
    if interval is not None:
        turns = times / interval - np.arange(len(times))
        # A loss among the last samples does not show in the envelope: they are not counted.
        turns = turns[: -min(_TAIL, len(turns) // 2)]
    else:
        sought, agreement = rate_line(times)
        turns = _phases(times / sought)
        interval = sought if gain <= 0.0 else None
    if agreement > _AGREEING:
        gain = max(gain, _one_sided(turns, rounding / mean))
    apart = np.mean(short) < _ORDINARY_TOGETHER
    slow = _polled_slowly(stream, fresh, 2.0 * (tolerance + rounding)) if apart else None
    if slow is not None and slow.gain > gain:
        return slow
    if gain <= 0.0:
        return None
    grid = envelope_grid(times, interval)
    low, high = np.quantile(grid.late, [0.05, 0.95])
    if high - low < 2.0 * (tolerance + rounding):
        return None
    return _on_grid(stream, fresh, grid, gain, short, steps)


def _polled_slowly(stream: Stream, fresh: NDArray[np.bool_], least: float) -> Late | None:
    """A stream on the lattice of a driver's polls, quicker than the device, whose values are even."""
    times = seconds(stream.stamps)[fresh]
    interval = rate_line(times, mean_interval(times))[0]
    period, gain = lattice(times, interval, least)
    if gain <= 0.0:
        return None
    index = np.arange(len(times))
    rest = times - interval * index
    # Each sample waits for the next poll, for half a period in the middle; a stall of the driver moves few
    start = float(np.median(rest)) - 0.5 * period
    grid = Grid(start, interval, index, rest - start)
    if np.quantile(grid.late, 0.9) > 1.5 * period or np.min(grid.late) < -0.5 * period:
        return None  # samples were lost: values do not tell
    gain = min(gain, measured_evenly(stream.channel.values[fresh], grid.late, interval))
    steps = np.diff(times)
    late = _on_grid(stream, fresh, grid, gain, steps < TOGETHER * interval, steps)
    return replace(late, handover=period, polled=True) if gain > 0.0 else None


def resolution(stamps: Stamps) -> float:
    """s, the power of ten of which nineteen in twenty stamps are multiples, from the first one on."""
    power, since = 1, stamps - stamps[0]
    while power < SECOND and np.mean(since % (10 * power) == 0) > 0.95:
        power *= 10
    return power / SECOND


def _on_grid(
    stream: Stream, fresh: NDArray[np.bool_], grid: Grid, gain: float, short: NDArray[np.bool_], steps: Array
) -> Late:
    handovers = steps[~short]
    low, middle, high = np.quantile(handovers, [0.25, 0.5, 0.75])
    stamps = stream.stamps.copy()
    stamps[fresh] = stream.stamps[0] + np.round(grid.times * SECOND).astype(np.int64)
    # The shortest latency seen is of the size of their spread, unless the driver polls: then of one transfer.
    spread = float(np.quantile(grid.late, 0.75) - np.quantile(grid.late, 0.25))
    polled = bool(np.mean(short) > _ORDINARY_TOGETHER and high - low < 0.3 * middle)
    return Late(
        grid=grid, stamps=stamps, gain=gain, together=int(np.count_nonzero(short)), handover=float(middle),
        polled=polled, std=max(0.25 * spread, 1e-3),
    )  # fmt: skip


def _fresh(stream: Stream) -> tuple[Array, NDArray[np.bool_]]:
    """Times (s) of the messages that are no repetition of the one before, and which these are."""
    same = np.diff(stream.stamps) == 0
    values = stream.channel.values
    repeated = (
        same & np.all((np.diff(values, axis=0) == 0) | np.isnan(values[1:]), axis=1) if same.any() else same
    )
    fresh = np.concatenate(([True], ~repeated))
    return seconds(stream.stamps)[fresh], fresh


def _phases(turns: Array) -> Array:
    """(n,) intervals by which times lie off the nearest of their regular times, for the best-lying such."""
    middle = np.angle(np.mean(np.exp(2j * np.pi * turns))) / (2.0 * np.pi)
    return np.asarray(np.mod(turns - middle + 0.5, 1.0) - 0.5)


def _one_sided(deviations: Array, rounding: float) -> float:
    """Nats for deviations from regular sampling (in intervals) that are late more often than early.

    Of the largest deviations about their middle, ordinary jitter has as many on either side, whatever its
    law. Rounding moves the middle by half of its step at most, and either side by as much again. Deviations
    that last several samples count once.
    """
    about = deviations - np.median(deviations)
    if np.std(about) == 0.0:
        return 0.0
    relation = float(np.clip(np.corrcoef(about[1:], about[:-1])[0, 1], 0.0, 0.999))
    independent = _LARGEST * len(about) * (1.0 - relation) / (1.0 + relation)
    moved = (about + part * rounding for part in (-1.0, 0.0, 1.0))
    return independent * min(_relative_entropy(_late_part(one), 0.5) for one in moved)


def _late_part(phase: Array) -> float:
    """Part of the largest deviations that are late."""
    size = np.abs(phase)
    return float(np.mean(phase[size >= np.quantile(size, 1.0 - _LARGEST)] > 0.0))


def _relative_entropy(part: float, ordinary: float) -> float:
    """Nats a trial for a frequency above the ordinary one, 0 for one below."""
    if part <= ordinary:
        return 0.0
    rest = 0.0 if part >= 1.0 else (1.0 - part) * math.log((1.0 - part) / (1.0 - ordinary))
    return part * math.log(part / ordinary) + rest
