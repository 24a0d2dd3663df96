"""A recording cut off, or thought to go on: the same devices, shorter or longer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.recording import Recording, Series, Session

Array = NDArray[np.float64]

#: Force of the exciter at times (n,) s of the recording: (n, 3) N, exciter frame.
Force = Callable[[Array], Array]
#: Share of a recorded force that is looked through for a stretch that repeats, its end, and the longest lag
#: as a share of that: what is left has to show that it repeats.
TAIL, LONGEST_LAG = 0.6, 0.75


def until(recording: Recording, seconds: float) -> Recording:
    """What of a recording was there after so many ``seconds``."""
    return _each(recording, lambda series: _cut(series, seconds), min(seconds, recording.duration))


def so_far(session: Session, seconds: float) -> Session:
    """The session with its dynamic recordings cut off."""
    parts = tuple(until(r, seconds) if r.kind == "dynamic" else r for r in session.recordings)
    return replace(session, recordings=parts)


def going_on(recording: Recording, seconds: float, force: Force | None = None) -> Recording:
    """A recording as if it lasted ``seconds``: stamps at each device's own rate, readings of no meaning.

    force: the exciter's from now on; None: as it was last, repeated (:func:`repeats`). The readings that are
    made up repeat what was recorded: whoever looks at derivatives alone may use them.
    """
    going = _each(recording, lambda series: _repeated(series, seconds, series.time.size), seconds)
    old = recording.exciter_force
    if old is None or old.time.size < 2:
        return going
    new = _repeated(old, seconds, repeats(old))
    if force is not None:
        values = new.values.copy()
        values[old.time.size :] = force(new.time[old.time.size :])
        new = Series(new.time, values)
    return replace(going, exciter_force=new)


def repeats(series: Series) -> int:
    """Samples after which the last part of a series is most like itself: a period, or several.

    Where nothing repeats it is the lag of the smallest difference all the same: what comes then is as strong
    as what was, and of the same frequencies.
    """
    values = series.values - np.mean(series.values, axis=0)
    size = max(2, int(TAIL * len(values)))
    tail = np.nan_to_num(values[-size:])
    shortest = max(1, size // 8)
    lags = np.arange(shortest, int(LONGEST_LAG * size) + 1)
    if lags.size == 0:
        return size
    power = np.concatenate([[0.0], np.cumsum(np.sum(tail**2, axis=1))])
    spectrum = np.fft.rfft(tail, 2 * size, axis=0)
    alike = np.sum(np.fft.irfft(np.abs(spectrum) ** 2, axis=0), axis=1)[lags]
    # |f(t) - f(t - L)|^2 a sample, over where both are
    difference = power[size] - power[lags] + power[size - lags] - 2.0 * alike
    return int(lags[np.argmin(difference / (size - lags))])


def _each(recording: Recording, change: Callable[[Series], Series], duration: float) -> Recording:
    def of(series: Series | None) -> Series | None:
        return None if series is None else change(series)

    return replace(
        recording,
        duration=duration,
        tension={name: change(series) for name, series in recording.tension.items()},
        exciter_force=of(recording.exciter_force),
        exciter_shaft=of(recording.exciter_shaft),
        imu=of(recording.imu),
        inclination=of(recording.inclination),
        mocap=of(recording.mocap),
        ground_truth=of(recording.ground_truth),
    )


def _cut(series: Series, seconds: float) -> Series:
    size = int(np.searchsorted(series.time, seconds, side="right"))
    return Series(series.time[:size], series.values[:size])


def _repeated(series: Series, seconds: float, lag: int) -> Series:
    """The series up to ``seconds``: its last ``lag`` samples again and again."""
    size = series.time.size
    if size < 2 or series.time[-1] >= seconds:
        return _cut(series, seconds)
    step = float(np.median(np.diff(series.time)))
    more = np.arange(1, int((seconds - series.time[-1]) / step) + 1)
    values = series.values[size - lag + (more - 1) % lag]
    return Series(
        np.concatenate([series.time, series.time[-1] + step * more]), np.concatenate([series.values, values])
    )
