"""Recordings reduced to what a consistency test needs: medians at rest, and motion smoothed alike everywhere.

Channels of a run are smoothed by one Gaussian kernel and taken at common instants. The same linear
filter in every channel keeps each linear relation between channels; noise and ringing above it go.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.recording import Dummy
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: s; motion looked at in one run. A dozen swings of a vehicle rig decide every discrete question.
WINDOW = 12.0
#: Kernel of the smoothing (s): between what the slowest channel resolves and the period of a rig's swing.
NARROWEST, WIDEST = 0.02, 0.1
#: Kernels in a period of the motion at least: a span of its spline is three of them, and four spans hold a
#: period. A reading that is sampled more seldom than a kernel cannot be smoothed by it and takes no part.
IN_A_PERIOD = 12.0
#: Share of a reading's power below its highest frequency, and times the median ordinate that its largest one
#: has at least where it is motion and no noise.
POWER, STANDS_OUT = 0.9, 100.0
#: Channels that take part; a shaft and a simulation's truth do not.
CHANNELS = ("tension", "exciter_force", "imu", "inclination", "mocap")
#: Instants come in such groups, one a span of the motion's spline; fewer than these are no motion.
PER_SPAN, FEWEST = 3, 21
#: ... by more than this factor: a median interval jitters.
SLOWER = 1.2
#: A gap of more kernels than this holds no information.
GAP = 4.0
#: A channel that covers less of the window than this share is left out of it.
COVERED = 0.5


@dataclass(frozen=True)
class Reduced:
    """One recording: at rest one row a device, in motion one row an instant."""

    name: str
    kind: str
    holdout: bool
    dummy: Dummy | None
    time: Array  # (N,) s after the recording's start; one instant at rest
    kernel: float  # s, width of the smoothing; 0 at rest
    values: Mapping[str, Array]  # device -> (N, width); NaN: not measured
    start_ns: int

    def with_values(self, changed: Mapping[str, Array]) -> Reduced:
        """The recording with some devices' readings replaced."""
        return replace(self, values={**self.values, **changed})


@dataclass(frozen=True)
class ReducedSession:
    """A session's description and reduced recordings."""

    rig: Rig
    recordings: tuple[Reduced, ...]

    @property
    def at_rest(self) -> tuple[Reduced, ...]:
        """Recordings at rest, means of the runs where there are none."""
        rest = tuple(r for r in self.recordings if r.kind == "static")
        return rest or tuple(_mean_of(r) for r in self.runs)

    @property
    def runs(self) -> tuple[Reduced, ...]:
        """Recordings in motion that may be fitted; all where all are held out."""
        runs = tuple(r for r in self.recordings if r.kind == "dynamic")
        return tuple(r for r in runs if not r.holdout) or runs


def reduced(session: RawSession) -> ReducedSession:
    """Reduce every recording. Channels with stamps elsewhere, or without a number, do not take part."""
    recordings = (_recording(recording) for recording in session.recordings)
    return ReducedSession(session.rig, tuple(r for r in recordings if r is not None))


def _recording(raw: RawRecording) -> Reduced | None:
    channels = [c for c in raw.channels if c.channel in CHANNELS and _usable(c)]
    if not channels:
        return None
    start = float(np.median([_sorted(c)[0][0] for c in channels]))
    if raw.kind == "static":
        return _at_rest(raw, channels, start)
    return _in_motion(raw, channels, start)


def _usable(channel: RawChannel) -> bool:
    return len(channel.stamp_ns) > 1 and bool(np.isfinite(channel.values).any()) and channel.stamp_ns[0] > 0


def _sorted(channel: RawChannel) -> tuple[Array, Array]:
    """Stamps (n,) in ns and values (n, w) in order of time, rows with a number alone, one a stamp."""
    known = np.isfinite(channel.values).any(axis=1) & (channel.stamp_ns > 0)
    if not known.any():
        known = channel.stamp_ns > 0
    stamps, first = np.unique(channel.stamp_ns[known], return_index=True)
    return stamps.astype(float), channel.values[known][first]


def _at_rest(raw: RawRecording, channels: list[RawChannel], start: float) -> Reduced:
    values = {}
    for channel in channels:
        rows = channel.values
        if channel.channel == "mocap":
            rows = _continuous(rows)
        values[channel.device] = _median(rows)
    one = np.zeros(1)
    return Reduced(raw.name, raw.kind, raw.holdout, raw.dummy, one, 0.0, values, int(start))


def _median(rows: Array) -> Array:
    """(1, w) medians of what is measured, NaN where nothing is."""
    known = [column[np.isfinite(column)] for column in rows.T]
    return np.array([[np.median(column) if column.size else np.nan for column in known]])


def _in_motion(raw: RawRecording, channels: list[RawChannel], start: float) -> Reduced | None:
    series = {c.device: _sorted(c) for c in channels}
    begin, end = _window(series, start)
    kernel = _kernel(series, start, begin, end)
    time = np.arange(begin + 3.0 * kernel, end - 3.0 * kernel, kernel)
    time = time[: time.size // PER_SPAN * PER_SPAN]
    if time.size < FEWEST:
        return None
    values = {}
    for channel in channels:
        stamps, rows = series[channel.device]
        if _interval(stamps) > SLOWER * kernel:
            continue
        if channel.channel == "mocap":
            rows = _continuous(rows)
        if channel.channel in ("imu", "inclination"):
            rows = _measured(rows)
        smooth = _smoothed((stamps - start) * 1e-9, rows, time, kernel)
        if np.mean(np.isfinite(smooth).any(axis=1)) > COVERED:
            values[channel.device] = smooth
    return Reduced(
        raw.name, raw.kind, raw.holdout, raw.dummy, time - time[0], kernel, values, int(start + 1e9 * time[0])
    )


def _interval(stamps: Array) -> float:
    """Median sampling interval, s."""
    return float(np.median(np.diff(stamps))) * 1e-9 if len(stamps) > 2 else 0.0


def _kernel(series: Mapping[str, tuple[Array, Array]], start: float, begin: float, end: float) -> float:
    """Width (s) of the smoothing: what the slowest channel resolves, if the motion in a window is as slow."""
    slowest = max((_interval(t) for t, _ in series.values()), default=NARROWEST)
    highest = []
    for stamps, rows in series.values():
        time = (stamps - start) * 1e-9
        inside = (time >= begin) & (time < end)
        if np.count_nonzero(inside) >= FEWEST:
            highest += [_highest(time[inside], column[inside]) for column in rows.T]
    moving = [f for f in highest if f > 0.0]
    motion = 1.0 / (IN_A_PERIOD * float(np.median(moving))) if moving else WIDEST
    return float(np.clip(min(slowest, motion), NARROWEST, WIDEST))


def _highest(time: Array, values: Array) -> float:
    """Frequency (Hz) below which most of a reading's power lies; 0 where it is noise, or not measured."""
    if not np.isfinite(values).all() or not np.ptp(values) > 0.0:
        return 0.0
    power = np.abs(np.fft.rfft((values - np.mean(values)) * np.hanning(values.size)))[1:] ** 2
    if not np.max(power) > STANDS_OUT * np.median(power):
        return 0.0
    below = int(np.searchsorted(np.cumsum(power), POWER * np.sum(power)))
    return (below + 1) / float(time[-1] - time[0])


def _window(series: Mapping[str, tuple[Array, Array]], start: float) -> tuple[float, float]:
    """Begin and end (s) of the stretch in which readings vary most, each over its own whole variance."""
    begins = sorted((t[0] - start) * 1e-9 for t, _ in series.values())
    ends = sorted((t[-1] - start) * 1e-9 for t, _ in series.values())
    begin, end = begins[len(begins) // 2], ends[len(ends) // 2]
    count = max(1, int((end - begin) // WINDOW))
    edges = begin + WINDOW * np.arange(count + 1)
    share = np.zeros(count)
    for t, rows in series.values():
        whole = _variance(rows)
        whole = np.where(whole > 0.0, whole, np.inf)
        at = np.searchsorted(t, start + 1e9 * edges)
        for k, (a, b) in enumerate(pairwise(at)):
            if b - a > 2:
                share[k] += float(np.sum(_variance(rows[a:b]) / whole))
    best = begin + WINDOW * int(np.argmax(share))
    return best, min(best + WINDOW, end)


def _smoothed(stamp: Array, rows: Array, time: Array, kernel: float) -> Array:
    """(N, w) rows smoothed at ``time``, NaN where there is no sample within a few kernels."""
    fine = kernel / 5.0
    grid = np.arange(time[0] - 4.0 * kernel, time[-1] + 4.0 * kernel, fine)
    out = np.full((time.size, rows.shape[1]), np.nan)
    for j, column in enumerate(rows.T):
        known = np.isfinite(column)
        if np.count_nonzero(known) < 3:
            continue
        t, y = stamp[known], column[known]
        smooth = gaussian_filter1d(np.interp(grid, t, y), kernel / fine, mode="nearest")
        near = np.searchsorted(t, time)
        gap = t[np.minimum(near, t.size - 1)] - t[np.maximum(near - 1, 0)]
        far = (time < t[0]) | (time > t[-1]) | (gap > GAP * kernel)
        out[:, j] = np.where(far, np.nan, np.interp(time, grid, smooth))
    return out


def _measured(rows: Array) -> Array:
    """(n, w) rows; a component that never changes while the body moves was filled in, not measured."""
    seen = np.ma.masked_invalid(rows)
    still = np.ma.filled(seen.max(axis=0) == seen.min(axis=0), True)
    return np.where(still, np.nan, rows)


def _continuous(poses: Array) -> Array:
    """(n, 7) poses whose quaternions do not change sign from row to row."""
    turn = poses[:, 3:7]
    flips = np.sum(turn[1:] * turn[:-1], axis=1) < 0.0
    sign = np.concatenate([[1.0], np.where(np.cumsum(flips) % 2, -1.0, 1.0)])
    return np.concatenate([poses[:, :3], turn * sign[:, None]], axis=1)


def _mean_of(run: Reduced) -> Reduced:
    """A run's means as if it were at rest: right to second order of the swing."""
    values = {device: _mean(rows) for device, rows in run.values.items()}
    return replace(run, time=np.zeros(1), values=values)


def _mean(rows: Array) -> Array:
    """(1, w) means of what is measured, NaN where nothing is."""
    return np.asarray(np.ma.masked_invalid(rows).mean(axis=0).filled(np.nan))[None]


def _variance(rows: Array) -> Array:
    """(w,) variances of what is measured, zero where nothing is."""
    return np.asarray(np.ma.masked_invalid(rows).var(axis=0).filled(0.0))
