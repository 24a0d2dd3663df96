"""What a channel reads without a fault: a smooth signal, white noise of constant std, a converter's step.

Every kind of fault in this folder is a departure from this model. No fault is told unless the model makes
what is seen with a probability below ``FALSE_ALARM`` for a whole channel.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

from rig_identification.raw import RawChannel, RawSession

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.int64]

#: Probability that a channel without a fault is told to have one.
FALSE_ALARM = 1e-6
#: Noise of at least this many steps of the converter is seen in every few samples. Rounding alone makes
#: 1 / sqrt(12) = 0.29 steps of a signal without any noise; three times that is noise of its own.
NOISY = 1.0
#: Quantities of a device that may be read apart: columns of the channel.
_GROUPS: dict[str, dict[str, tuple[int, ...]]] = {
    "tension": {"tension": (0,)},
    "exciter_force": {"exciter_force": (0, 1, 2)},
    "exciter_shaft": {"exciter_shaft": (0, 1)},
    "imu": {"angular_rate": (0, 1, 2), "specific_force": (3, 4, 5)},
    "inclination": {"inclination": (0, 1)},
    "mocap": {"mocap": (0, 1, 2, 3, 4, 5, 6)},
}
#: Samples of a block over which noise is taken to be all that sixth differences leave.
_BLOCK = 64
#: Differences of these orders of white noise, each over its own gain, agree; those of a signal do not.
_LOW, _HIGH = 3, 6
#: Std of the ratio of both from a block is about 0.1: 1.5 is five of them.
_WHITE = 1.5


def channels_of(session: RawSession) -> Iterator[tuple[tuple[str, str], list[tuple[int, RawChannel]]]]:
    """Each measured channel as ((device, channel), [(index of the recording, its messages), ...])."""
    found: dict[tuple[str, str], list[tuple[int, RawChannel]]] = {}
    for number, recording in enumerate(session.recordings):
        for channel in recording.channels:
            if channel.channel in _GROUPS and len(channel.stamp_ns) > 1:
                found.setdefault((channel.device, channel.channel), []).append((number, channel))
    yield from found.items()


def groups(channel: RawChannel) -> dict[str, tuple[int, ...]]:
    """Quantity -> columns that are measured and vary; a quantity without any is left out."""
    found = {}
    with np.errstate(invalid="ignore"):
        for name, columns in _GROUPS[channel.channel].items():
            kept = tuple(k for k in columns if _varies(channel.values[:, k]))
            if kept:
                found[name] = kept
    return found


def _varies(column: Array) -> bool:
    finite = column[np.isfinite(column)]
    return bool(len(finite) > 1 and np.ptp(finite) > 0.0)


def interval(channel: RawChannel) -> float:
    """Median interval of the stamps in s; of the receive times where the stamps do not run on."""
    for stamps in (channel.stamp_ns, channel.received_ns):
        steps = np.diff(stamps)
        if len(steps) and np.median(steps) > 0:
            return float(np.median(steps)) / 1e9
    return 0.0


def seconds(channel: RawChannel, start_ns: int) -> Array:
    """(n,) s after the recording's first stamp."""
    return np.asarray((channel.stamp_ns - start_ns) / 1e9)


def resolution(column: Array) -> float:
    """Step of the converter: the gap between neighbouring values that occur, 0 where there is but one.

    The first percentile of the gaps and not the least one: a single damaged value lies anywhere.
    """
    levels = np.unique(column[np.isfinite(column)])
    if len(levels) < 2:
        return 0.0
    return float(np.percentile(np.diff(levels), 1.0, method="lower"))


def noise_std(column: Array) -> float:
    """Std of the white noise, 0 where no block of the readings is a smooth signal and white noise alone.

    Differences of the third and of the sixth order, each divided by its gain for white noise, agree where
    white noise is all that they leave. The quietest quarter of the blocks decides: knocks only add.

    Parameters
    ----------
    column : (n,)
        In order of time. Blocks with a missing sample, and constant ones, do not count.
    """
    count = (len(column) - _HIGH) // _BLOCK
    if count < 1:
        return 0.0
    low, high = (_block_rms(column, order, count) for order in (_LOW, _HIGH))
    usable = np.isfinite(low) & np.isfinite(high) & (high > 0.0)
    if not usable.any():
        return 0.0
    low, high = low[usable], high[usable]
    quiet = np.argsort(high, kind="stable")[: max(1, len(high) // 4)]
    white = low[quiet] < _WHITE * high[quiet]
    return float(np.median(high[quiet])) if 2 * np.count_nonzero(white) > len(quiet) else 0.0


def _block_rms(column: Array, order: int, count: int) -> Array:
    """(count,) root mean square of a block's differences over the gain that white noise has."""
    bends = np.diff(column, order)[: count * _BLOCK].reshape(count, _BLOCK)
    # The squares of the binomial coefficients sum up to (2 order over order)
    return np.asarray(np.sqrt(np.mean(bends**2, axis=1) / comb(2 * order, order)))


def same_by_chance(values: Array, columns: tuple[int, ...]) -> float:
    """Most probable share of samples that equal the one before in all columns; 1 where nothing is known.

    Two samples are rounded to one value at best where the signal rests in the middle of a step.
    """
    chance = 1.0
    for k in columns:
        std, step = noise_std(values[:, k]), resolution(values[:, k])
        if std >= NOISY * step > 0.0:
            chance *= float(erf(step / (2.0 * np.sqrt(2.0) * std)))
    return chance


def longest_by_chance(count: int, chance: float) -> float:
    """Repeats in a row that ``count`` samples reach with probability ``FALSE_ALARM``; inf where chance is 1.

    Each sample begins a run of k repeats with probability chance**k at most.
    """
    if chance >= 1.0 - 1e-12:
        return np.inf
    return float(np.log(FALSE_ALARM / max(count, 1)) / np.log(max(chance, 1e-300)))


def runs(flags: Flags) -> tuple[Indices, Indices]:
    """First index, and the one behind the last, of each run of true ``flags`` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(np.int8)))
    return edges[::2].astype(np.int64), edges[1::2].astype(np.int64)


def repeats(values: Array, columns: tuple[int, ...]) -> Flags:
    """(n,) whether a sample equals the one before in all ``columns``, exactly."""
    chosen = values[:, list(columns)]
    return np.concatenate(([False], np.all(chosen[1:] == chosen[:-1], axis=1)))
