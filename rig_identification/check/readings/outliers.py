"""What in one channel stands out of a smooth signal and its noise: outliers, and those that stand alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import correlate1d, median_filter, uniform_filter1d

from rig_identification.check.readings.channel_model import (
    Array,
    Flags,
    Indices,
    groups,
    interval,
    resolution,
    runs,
    seconds,
)
from rig_identification.cleaning.clipping import limits
from rig_identification.raw import RawChannel

#: Samples of the running median behind which a smooth signal hides: three damaged ones leave it alone.
_MEDIAN = 9
#: Samples and order of the polynomial that takes a signal's bends away before.
_SMOOTH, _ORDER = 21, 3
#: Weights of the samples around one that make such a polynomial's value at it (Savitzky and Golay).
#: scipy.signal would give them, and take most of a second to import.
_POLYNOMIAL = np.linalg.pinv((np.arange(_SMOOTH)[:, None] - _SMOOTH // 2.0) ** np.arange(_ORDER + 1))[0]
#: The longest spike.
_LONGEST = 3
#: Noise is this many std off once in 1e15 samples, and once in 1e6 channels of 1e3 samples at 6.
_FAR = 8.0
OUTLIER = 6.0
#: Samples on either side of a spike to which a cubic is fitted, and how many of them there must be.
_BESIDE, _LEAST = 8, 10
#: Std of what the cubic leaves: Student's t of 12 degrees of freedom is beyond this with 4e-6, of which the
#: outliers that are looked at are one sample in ten thousand.
_OVER_BESIDE = 8.0
#: What rings on is right beside its first swing by more than noise and a tenth of it.
_RINGS, _SWING = 4.5, 0.1
#: A normal distribution's std over the median of its absolute values.
_MEDIAN_TO_STD = 1.4826
#: Samples around an outlier of which it must stand out, and a normal distribution's std over its mean
#: deviation.
_AROUND, _MEAN_TO_STD = 101, 1.2533
#: Fourth differences of white noise: sqrt(1 + 16 + 36 + 16 + 1).
_GAIN_4 = 70.0**0.5
#: Spikes beside spikes are found when those are gone, this many times at most.
_PASSES = 5
#: Steps of the converter below which nothing is a spike: noise of one step may well be three off.
_STEPS = 8.0
#: A knock reaches the other devices within this, and their clocks differ by less once steps are taken off.
_SPREADING = 0.005  # s
#: Cables that carry less than this share of their ordinary load are slack, and may snap.
_SLACK = 0.1


@dataclass(frozen=True)
class Outliers:
    """What one channel shows beside its running median."""

    time: Array  # (n,) s
    off: Array  # (n,) largest deviation of a component in std of its noise
    spike: Flags  # (n,) isolated and far off
    reach: float  # s: within this of an outlier another device sees the same blow


def outliers(channel: RawChannel, begun: int) -> Outliers:
    time = seconds(channel, begun)
    off, spike = np.zeros(len(time)), np.zeros(len(time), bool)
    values = _continuous(channel)
    for k in [k for kept in groups(channel).values() for k in kept]:
        finite = np.isfinite(values[:, k])
        # At an end of range noise is cut on one side: what comes down from there is no spike
        there = np.flatnonzero(finite)
        for end in limits(values[there, k : k + 1]):
            finite[there[end.reached]] = False
        column = values[finite, k]
        if len(column) < _SMOOTH + _MEDIAN:
            continue
        scale = _noise(column)
        left = _bends_removed(column)
        # Where a device rings only what stands out of that is a blow
        around = uniform_filter1d(np.minimum(np.abs(left), OUTLIER * scale), _AROUND, mode="nearest")
        off[finite] = np.maximum(off[finite], np.abs(left) / np.maximum(scale, _MEAN_TO_STD * around))
        isolated = _all_isolated(column, scale)
        if channel.channel == "tension":
            isolated &= ~_slack(column, isolated)
        spike[finite] |= isolated
    return Outliers(time, off, spike, 1.5 * interval(channel) + _SPREADING)


def _continuous(channel: RawChannel) -> Array:
    """Values whose quaternions do not change sign from sample to sample: both signs are one turn."""
    if channel.channel != "mocap":
        return channel.values
    values = np.array(channel.values)
    turns = values[:, 3:7]
    product = np.sum(turns[1:] * turns[:-1], axis=1)
    values[1:, 3:7] *= np.cumprod(np.where(product < 0.0, -1.0, 1.0))[:, None]
    return values


def _noise(column: Array) -> float:
    """Std that noise or, where there is none, the converter's step and the arithmetic make at least."""
    bends = np.abs(np.diff(column, 4)) / _GAIN_4
    step = _STEPS / _FAR * resolution(column)
    return max(_MEDIAN_TO_STD * float(np.median(bends)), step, 1e-9 * float(np.ptp(column)))


def _bends_removed(column: Array) -> Array:
    """(n,) what is left of a column beside its running median, its slow bends taken away first."""
    calm = median_filter(column, _MEDIAN, mode="nearest")
    flat = column - correlate1d(calm, _POLYNOMIAL, mode="nearest")
    return np.asarray(flat - median_filter(flat, _MEDIAN, mode="nearest"))


def _all_isolated(column: Array, scale: float) -> Flags:
    """(n,) which samples stand alone; those beside others show once the others are gone."""
    spike = np.zeros(len(column), bool)
    there = np.arange(len(column))
    for _ in range(_PASSES):
        rest = column[there]
        alone = _isolated(rest, np.abs(_bends_removed(rest)) > 0.5 * _FAR * scale, scale)
        if not alone.any():
            break
        spike[there[alone]] = True
        there = there[~alone]
    return spike


def _isolated(column: Array, far: Flags, scale: float) -> Flags:
    """(n,) which of the ``far`` samples stand alone: three at most, far off a cubic through those beside.

    None where as many are off by half as much: that is the tail of the noise itself.
    """
    starts, ends = runs(far)
    short = ends - starts <= _LONGEST
    starts, ends = starts[short], ends[short]
    alone = np.zeros(len(column), bool)
    if not len(starts):
        return alone
    ratio = _off_a_cubic(column, starts, ends, scale)
    spikes = ratio > _OVER_BESIDE
    if np.count_nonzero(spikes) <= np.count_nonzero((ratio > 0.5 * _OVER_BESIDE) & ~spikes):
        return alone
    for a, b in zip(starts[spikes], ends[spikes], strict=True):
        alone[a:b] = True
    return alone


def _off_a_cubic(column: Array, starts: Indices, ends: Indices, scale: float) -> Array:
    """(k,) how far each group of samples is off a cubic through those beside it, in std of what that leaves.

    0 where the signal rings on beside it, or too few samples are there.
    """
    width = (ends - starts)[:, None]
    offset = np.arange(-_BESIDE, _BESIDE)[None, :] + np.where(np.arange(-_BESIDE, _BESIDE) < 0, 0, width)
    index = starts[:, None] + offset
    taken = np.zeros(len(column), bool)
    for a, b in zip(starts, ends, strict=True):
        taken[a:b] = True
    there = (index >= 0) & (index < len(column))
    index = np.clip(index, 0, len(column) - 1)
    weight = (there & ~taken[index]).astype(float)
    powers = (offset[..., None] / _BESIDE) ** np.arange(4)
    weighted = powers * weight[..., None]
    # A ridge far below any sample's weight keeps the empty windows solvable
    normal = weighted.transpose(0, 2, 1) @ powers + 1e-12 * np.eye(4)
    values = column[index] - column[starts][:, None]
    cubic = np.linalg.solve(normal, weighted.transpose(0, 2, 1) @ values[..., None])
    left = np.abs(values - (powers @ cubic)[..., 0]) * weight
    number = weight.sum(axis=1)
    usual = np.maximum(np.sqrt(np.sum(left**2, axis=1) / np.maximum(number - 4, 1)), scale)
    inside = np.arange(_LONGEST)[None, :]
    own = column[np.clip(starts[:, None] + inside, 0, len(column) - 1)] - column[starts][:, None]
    off = np.abs(own - ((inside[..., None] / _BESIDE) ** np.arange(4) @ cubic)[..., 0])
    least = np.min(np.where(inside < width, off, np.inf), axis=1)
    near = np.max(left[:, _BESIDE - _LONGEST : _BESIDE + _LONGEST], axis=1)
    both = (weight[:, :_BESIDE].sum(axis=1) > 1) & (weight[:, _BESIDE:].sum(axis=1) > 1)
    usable = both & (number >= _LEAST) & (near <= np.maximum(_RINGS * scale, _SWING * least))
    return np.asarray(np.where(usable, least / usual, 0.0))


def _slack(column: Array, spike: Flags) -> Flags:
    """(n,) which spikes begin where the cable carries next to nothing."""
    slack = np.zeros(len(column), bool)
    ordinary = float(np.median(np.abs(column)))
    for a, b in zip(*runs(spike), strict=True):
        sides = (column[max(a - _MEDIAN, 0) : a], column[b : b + _MEDIAN])
        least = min(abs(float(np.median(side))) for side in sides if len(side))
        slack[a:b] = least < _SLACK * ordinary
    return slack
