"""How noisy one sample of a device is: what the rig description says, checked against the samples themselves.

A standard deviation that is too small is the worst of the description's errors: intervals shrink with it,
and what is left of other channels is bent to the loud one. So where the samples scatter more than described
at frequencies and at times that no motion reaches, the samples are believed.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import digamma

from rig_identification.estimate.sampling import LOCAL, UNEVEN, sample_noise_std
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Samples of a segment whose spectrum is taken, and segments below which there is no telling.
SEGMENT, FEWEST = 128, 4
#: The upper part of the band, above motion, in which a floor is looked for.
ABOVE = 0.5
#: Samples that a cubic is fitted to at least.
FITTED_SAMPLES = 7
#: Order of the differences that leave nothing of a motion but its noise.
ORDER = 6
#: The samples are believed against the description where they scatter by so many times more; by so much more
#: still where only one segment tells (chance moves the floor of n segments by 0.15 / sqrt(n)).
LOUDER, CHANCE = 1.2, 0.6


def noise_std(rig: Rig, name: str, time: Array, values: Array) -> tuple[Array, bool]:
    """(std of one sample (w,), whether it was estimated): described, or read off the samples themselves."""
    if name not in rig.noise:
        return np.maximum(_estimated(name, time, values), 1e-9), True
    described = np.full(values.shape[1], rig.noise[name])
    floor = white_floor(time, values)
    segments = max(1, values.shape[0] // SEGMENT)
    louder = floor > (LOUDER + CHANCE / np.sqrt(segments)) * described
    return np.where(louder, floor, described), bool(np.any(louder))


def _estimated(name: str, time: Array, values: Array) -> Array:
    """(w,) noise that no description tells.

    A cubic over a moment leaves all of it, coloured or not; at a low rate that moment is long enough for the
    motion to be no cubic, and only the floor tells, or what sixth differences leave. A tracker's bursts are
    noise at any rate: they move differences, and no floor.
    """
    rest = sample_noise_std(time, values)
    rate = (time.size - 1) / max(float(time[-1] - time[0]), 1e-9)
    if FITTED_SAMPLES / rate <= LOCAL:
        return rest
    floor = np.zeros(values.shape[1]) if name.startswith("mocap") else white_floor(time, values)
    return np.minimum(rest, np.where(floor > 0.0, floor, _left_by_differences(time, values)))


def _left_by_differences(time: Array, values: Array) -> Array:
    """(w,) rms of sixth differences over their gain for white noise; infinite where too few can tell.

    Of a swing of which a period holds n samples they leave (2 sin(pi / n))^6 / sqrt(924): at 13 of them 4e-4
    of its amplitude.
    """
    steps = np.diff(time)
    even = np.abs(steps - np.median(steps)) < UNEVEN * np.median(steps)
    if even.size < FEWEST * ORDER:
        return np.full(values.shape[1], np.inf)
    usable = np.lib.stride_tricks.sliding_window_view(even, ORDER).all(axis=1)
    if np.count_nonzero(usable) < FEWEST * ORDER:
        return np.full(values.shape[1], np.inf)
    bends = np.diff(values, ORDER, axis=0)[usable]
    return np.asarray(np.sqrt(np.mean(bends**2, axis=0) / comb(2 * ORDER, ORDER)))


def white_floor(time: Array, values: Array) -> Array:
    """(w,) standard deviation of the white noise under a signal; samples (n, w); zero where too few can tell.

    Only segments of equidistant samples tell: across a sample that is missing motion looks like noise.
    Of short segments' spectra the geometric mean over time, which neither a burst nor a snap moves far, and
    of its upper band the median, which no line does. An ordinate of white noise is exponential: the mean of
    its logarithm is digamma(1) below the logarithm of its mean.
    """
    count = values.shape[0] // SEGMENT
    if count < FEWEST:  # and a single sample has no step
        return np.zeros(values.shape[1])
    steps = np.diff(time[: count * SEGMENT], prepend=2.0 * time[0] - time[1]).reshape(count, SEGMENT)
    even = np.all(np.abs(steps - np.median(steps)) < UNEVEN * np.median(steps), axis=1)
    if np.count_nonzero(even) < FEWEST:
        return np.zeros(values.shape[1])
    pieces = values[: count * SEGMENT].reshape(count, SEGMENT, -1)[even]
    window = np.hanning(SEGMENT)
    pieces = (pieces - np.mean(pieces, axis=1, keepdims=True)) * window[:, None]
    power = np.abs(np.fft.rfft(pieces, axis=1)) ** 2 / np.sum(window**2)
    upper = power[:, int(ABOVE * power.shape[1]) : -1]
    typical = np.exp(np.median(np.mean(np.log(upper + 1e-300), axis=0), axis=0) - digamma(1.0))
    return np.asarray(np.sqrt(typical))
