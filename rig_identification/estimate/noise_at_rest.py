"""How strong a device's noise is at the frequencies of the motion, as it shows where the body hangs at rest.

Real sensors' noise is not white: a filter takes its upper part, an amplifier and a bias that wanders add to
its lower part. One std of a sample, as a description has it, is then too small where the body moves, by the
root of the spectrum there over its mean. A fit that believes it claims too much, and finds physics in noise.
At rest nothing else moves: the median ordinate of the spectrum there is ln 2 times the mean one (exponential
law), and neither a residual swing nor a line of the mains moves it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.rest_evidence import RestEvidence
from rig_identification.recording import Recording, Series

Array = NDArray[np.float64]

#: Hz up to which a rig moves, and the share of the samples' rate that this is at most.
MOTION, SHARE = 10.0, 0.125
#: Ordinates of the spectrum that are left out at its lower end, where a zero drifts, and the fewest that
#: tell.
DRIFTING, FEWEST = 3, 24
#: Std of a median of n exponential ordinates over their mean, times sqrt(n); and in how many of them noise
#: that is white is not told.
MEDIAN_STD, CHANCE = 1.44, 4.0

#: Device and quantity.
Key = tuple[str, str]


def slow_noise(rests: Iterable[RestEvidence]) -> dict[Key, Array]:
    """By device and quantity the factor (w,) on the noise of what is measured at rest; none where it is 1."""
    found: dict[Key, list[Array]] = {}
    for evidence in rests:
        for c in evidence.channels:
            series = _series(evidence.recording, c.device, c.quantity)
            part = None if series is None else _ordinates(series, c.noise)
            if part is not None:
                found.setdefault((c.device, c.quantity), []).append(part)
    factors = {key: _factor(np.concatenate(parts)) for key, parts in found.items()}
    return {key: factor for key, factor in factors.items() if np.any(factor > 1.0)}


def with_slow_noise(runs: tuple[Run, ...], factors: dict[Key, Array]) -> tuple[Run, ...]:
    """Runs whose channels are as noisy at the motion's frequencies as they are at rest."""

    def louder(run: Run) -> Run:
        channels = tuple(
            replace(c, slow=factors[c.device, c.quantity])
            if (c.device, c.quantity) in factors and factors[c.device, c.quantity].size == c.width
            else c
            for c in run.channels
        )
        return replace(run, channels=channels)

    return tuple(map(louder, runs)) if factors else runs


def told(runs: Iterable[Run]) -> tuple[str, ...]:
    """A sentence for each device whose noise in some runs is not white."""
    channels = (c for run in runs for c in run.channels)
    slow = {(c.device, c.quantity): c.slow for c in channels if c.slow is not None}
    return tuple(
        f"{device}: its {quantity.replace('_', ' ')} is {float(np.max(factor)):.2g} times as noisy at the "
        "frequencies of the motion as its samples scatter, as it shows at rest; the fit counts on that."
        for (device, quantity), factor in slow.items()
    )


def _factor(ordinates: Array) -> Array:
    """(w,) on the std of a sample, of ordinates (n, w) in units of its noise.

    1 where the noise may as well be white, or is weaker there.
    """
    count = ordinates.shape[0]
    power = np.median(ordinates, axis=0) / np.log(2.0)
    shows = power > 1.0 + CHANCE * MEDIAN_STD / np.sqrt(count)
    return np.where(shows & (count >= FEWEST), np.sqrt(np.maximum(power, 1.0)), 1.0)


def _series(recording: Recording, device: str, quantity: str) -> Series | None:
    """Samples (n, w) of one quantity at rest, where all of it is measured."""
    whole: Series | None
    if quantity == "tension":
        whole, columns = recording.tension.get(device), slice(0, 1)
    elif quantity == "angular_rate":
        whole, columns = recording.imu, slice(0, 3)
    elif quantity == "specific_force":
        whole, columns = recording.imu, slice(3, 6)
    else:
        whole, columns = recording.inclination, slice(0, 2)
    if whole is None or not np.isfinite(whole.values[:, columns]).all():
        return None
    return Series(whole.time, whole.values[:, columns])


def _ordinates(series: Series, noise: Array) -> Array | None:
    """(n, w) ordinates of a spectrum at the motion's frequencies, of samples in units of their noise.

    A sample that is missing here and there is drawn between its neighbours.
    """
    step = float(np.median(np.diff(series.time))) if series.time.size > 2 * FEWEST else 0.0
    if step <= 0.0 or noise.size != series.values.shape[1]:
        return None
    time = np.arange(series.time[0], series.time[-1], step)
    even = np.stack([np.interp(time, series.time, v) for v in series.values.T], axis=1) / noise
    count = time.size
    frequency = np.fft.rfftfreq(count, step)
    # A straight line leaks into all that is slow
    power = np.abs(np.fft.rfft(detrend(even, axis=0), axis=0)) ** 2 / count
    moving = frequency <= min(MOTION, SHARE / step)
    moving[: DRIFTING + 1] = False
    return np.asarray(power[moving])
