"""A steady line in what devices read while everything hangs still: the mains, a lamp, a fan's electronics.

Nothing of the rig holds one tone at one amplitude at rest but a building that shakes, and that is felt by the
IMU and by the load cells alike. So a line well above the body's swing, in every static recording, as strong
in its second half as in its first, and in one kind of device alone, is no force. It is taken out of what
these devices read, by its phase and amplitude in each recording, and told. The contract's table has no word
for that: the finding is ``unknown`` with its channel, frequency and amplitude.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar
from scipy.signal import periodogram

from rig_identification.estimate.parameters import AXES
from rig_identification.mismatch.findings import NO_EVIDENCE, with_mended, written
from rig_identification.recording import Recording, Series, Session
from rig_identification.result import Finding, Mismatch

Array = NDArray[np.float64]

#: Hz: no body on cables swings as fast.
LOWEST = 10.0
#: Chance of a line in white noise anywhere in a session.
FALSE_LINE = 1e-9
#: Bins over whose median power a line stands out, and the median of an exponential distribution's unit mean.
NEIGHBOURS = 41
MEDIAN = float(np.log(2.0))
#: Share by which a line's two halves may differ beside their own noise.
STEADY = 0.25
#: Steps, in parts of a recording's own resolution, in which a line's frequency is looked for, and how far, in
#: resolutions of the static recording that showed it.
FINE, ABOUT = 8, 1.0
#: Hz, to which a frequency is found: a thousandth of a turn in half a minute.
CLOSE = 3e-5
#: Samples that a spectrum takes.
FEWEST = 200


@dataclass(frozen=True)
class Line:
    """One tone in what one kind of device reads."""

    kind: str  # "tension", "angular_rate", "specific_force", "inclination"
    frequency: float  # Hz
    amplitudes: dict[tuple[str, str | None], float]  # device and axis -> the largest of any recording
    unit: str
    std: float  # of an amplitude
    resolution: float  # Hz, of the recordings that show it


@dataclass(frozen=True)
class _Column:
    """What one axis of one device read in a recording."""

    device: str
    axis: str | None
    kind: str
    unit: str
    time: Array  # (n,) s
    values: Array  # (n,)


def lines_at_rest(session: Session) -> list[Line]:
    """Steady lines that the static recordings show, each in one kind of device alone."""
    statics = [list(_columns(r)) for r in session.statics]
    if not statics:
        return []
    count = sum(max(1, c.values.size // 2) for columns in statics for c in columns)
    seen = [[(c, f) for c in columns for f in _peaks(c, count)] for columns in statics]
    out: list[Line] = []
    for column, frequency in seen[0]:
        near = _resolution(column)
        alike = [[(c, f) for c, f in found if abs(f - frequency) < 1.5 * near] for found in seen]
        kinds = {c.kind for found in alike for c, _ in found}
        known = any(line.kind == column.kind and abs(line.frequency - frequency) < 1.5 * near for line in out)
        if known or not all(alike) or len(kinds) > 1:
            continue
        out.append(Line(column.kind, frequency, {}, column.unit, 0.0, near))
    return [_measured(line, session) for line in out]


def without_lines(session: Session, lines: list[Line]) -> Session:
    """The session with the lines taken out of what their kind of device reads."""
    for line in lines:
        session = replace(session, recordings=tuple(_without(r, line) for r in session.recordings))
    return session


def with_lines(mismatch: Mismatch, lines: list[Line]) -> Mismatch:
    """The mismatch with what is to be said of the lines that were taken out."""
    tones = ", ".join(f"{line.frequency:.4g} Hz" for line in lines)
    return with_mended(
        mismatch, [_finding(line) for line in lines], f"{tones} taken out of what devices read"
    )


def _columns(recording: Recording) -> Iterator[_Column]:
    for cable, series in recording.tension.items():
        yield _Column(cable, None, "tension", "N", series.time, series.values[:, 0])
    if recording.imu is not None:
        for i, axis in enumerate(AXES):
            yield _column("imu", axis, "angular_rate", "rad/s", recording.imu, i)
            yield _column("imu", axis, "specific_force", "m/s^2", recording.imu, 3 + i)
    if recording.inclination is not None:
        for i, axis in enumerate(AXES[:2]):
            yield _column("inclinometer", axis, "inclination", "rad", recording.inclination, i)


def _column(device: str, axis: str, kind: str, unit: str, series: Series, index: int) -> _Column:
    """What a device measured along one axis."""
    known = np.isfinite(series.values[:, index])
    return _Column(device, axis, kind, unit, series.time[known], series.values[known, index])


def _resolution(column: _Column) -> float:
    return 1.0 / float(column.time[-1] - column.time[0])


def _peaks(column: _Column, count: int) -> list[float]:
    """Frequencies (Hz) of steady lines. count: spectral bins of all columns together."""
    if column.values.size < FEWEST:
        return []
    rate = 1.0 / float(np.median(np.diff(column.time)))
    frequency, power = periodogram(column.values, rate, window="hann", detrend="linear")
    fast = frequency >= LOWEST
    frequency, power = frequency[fast], power[fast]
    if power.size < NEIGHBOURS:
        return []
    floor = median_filter(power, NEIGHBOURS, mode="nearest") / MEDIAN
    stands = power > floor * np.log(count / FALSE_LINE)
    top = power >= np.maximum(np.roll(power, 1), np.roll(power, -1))
    # At an end of the band there are neighbours to one side alone
    beside = NEIGHBOURS // 2
    top[:beside] = top[-beside:] = False
    return [float(f) for f in frequency[stands & top] if _steady(column, float(f))]


def _steady(column: _Column, frequency: float) -> bool:
    """Whether both halves of a column hold the line alike: what rings dies away."""
    half = column.values.size // 2
    parts = [(column.time[part], column.values[part]) for part in (slice(half), slice(half, None))]
    (first, spread), (second, other) = (
        _tone(t, v, _refined([(t, v)], frequency, _resolution(column))) for t, v in parts
    )
    before, after = np.hypot(*first), np.hypot(*second)
    return bool(abs(before - after) < STEADY * max(before, after) + 3.0 * np.hypot(spread, other))


def _tone(time: Array, values: Array, frequency: float) -> tuple[Array, float]:
    """Cosine and sine amplitudes (2,) of a line, and the std of either.

    Weighted by a window that swings far below the line leave alone (Hann).
    """
    x = (time - time[0]) / (time[-1] - time[0])
    root = np.sqrt(np.hanning(time.size + 2)[1:-1])
    angle = 2.0 * np.pi * frequency * time
    base = np.stack([np.cos(angle), np.sin(angle), np.ones_like(x), x - 0.5], axis=1)
    found, *_ = np.linalg.lstsq(root[:, None] * base, root * values, rcond=None)
    # White noise has second differences of variance 6 v
    noise = np.sqrt(np.mean(np.diff(values - base @ found, 2) ** 2) / 6.0)
    spread = float(noise * np.sqrt(2.0 * np.sum(root**4)) / np.sum(root**2))
    return np.asarray(found[:2]), spread


def _refined(columns: list[tuple[Array, Array]], frequency: float, about: float) -> float:
    """The frequency (Hz) within ``about`` that takes most out of all columns, each its times and values."""
    step = min(1.0 / (FINE * float(time[-1] - time[0])) for time, _ in columns)
    reach = max(1, int(np.ceil(ABOUT * about / step)))

    def power(f: float) -> float:
        return sum(float(np.sum(_tone(time, v, f)[0] ** 2)) for time, v in columns)

    best = max(frequency + step * np.arange(-reach, reach + 1), key=power)
    between = (best - step, best + step)
    found = minimize_scalar(lambda f: -power(f), bounds=between, method="bounded", options={"xatol": CLOSE})
    return float(found.x)


def _in(recording: Recording, line: Line) -> tuple[list[_Column], float]:
    """Columns of the line's kind in a recording, and its frequency there."""
    columns = [c for c in _columns(recording) if c.kind == line.kind and c.values.size >= FEWEST]
    if not columns:
        return [], line.frequency
    return columns, _refined([(c.time, c.values) for c in columns], line.frequency, line.resolution)


def _measured(line: Line, session: Session) -> Line:
    """The line with its amplitudes, and its frequency in the recording that tells it best."""
    amplitudes: dict[tuple[str, str | None], float] = {}
    std, best = 0.0, (0.0, line.frequency)
    for recording in session.recordings:
        columns, frequency = _in(recording, line)
        for column in columns:
            tone, spread = _tone(column.time, column.values, frequency)
            key = (column.device, column.axis)
            amplitudes[key] = max(amplitudes.get(key, 0.0), float(np.hypot(*tone)))
            std = max(std, spread)
        if columns and recording.duration > best[0]:
            best = recording.duration, frequency
    return replace(line, amplitudes=amplitudes, std=std, frequency=best[1])


def _without(recording: Recording, line: Line) -> Recording:
    columns, frequency = _in(recording, line)
    out = recording
    for column in columns:
        tone, _ = _tone(column.time, column.values, frequency)
        angle = 2.0 * np.pi * frequency * column.time
        out = _less(out, column, tone[0] * np.cos(angle) + tone[1] * np.sin(angle))
    return out


def _less(recording: Recording, column: _Column, signal: Array) -> Recording:
    """A recording with a signal taken off one column."""

    def taken(series: Series, index: int) -> Series:
        values = series.values.copy()
        values[np.isfinite(values[:, index]), index] -= signal
        return replace(series, values=values)

    if column.device in recording.tension:
        series = taken(recording.tension[column.device], 0)
        return replace(recording, tension={**recording.tension, column.device: series})
    index = AXES.index(str(column.axis))
    if column.device == "imu" and recording.imu is not None:
        index += 3 if column.kind == "specific_force" else 0
        return replace(recording, imu=taken(recording.imu, index))
    if recording.inclination is not None:
        return replace(recording, inclination=taken(recording.inclination, index))
    return recording


def _finding(line: Line) -> Finding:
    device, axis = max(line.amplitudes, key=lambda key: line.amplitudes[key])
    amplitude = line.amplitudes[device, axis]
    where: dict[str, object] = {
        "channel": device,
        "axis": axis,
        "quantity": line.kind,
        "law": "interference",
    }
    who = "load cells" if line.kind == "tension" else f"{device}'s axes"
    text = (
        f"The {who} read a steady tone of {line.frequency:.5g} Hz at rest, {amplitude:.3g} {line.unit} in "
        f"{device}{'' if axis is None else ' ' + axis}, that no other kind of device feels: interference. "
        "It is taken out of all recordings. Look to shields, grounds and power supplies."
    )
    told = {
        "amplitude": (amplitude, line.std, line.unit),
        "frequency": (line.frequency, 0.0, "Hz"),
    }
    return Finding("unknown", where, written(told), NO_EVIDENCE, text)
