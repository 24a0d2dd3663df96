"""Whether the body hung at rest during a static recording, from the signals themselves.

A static recording is used through its means. A swing of rms angle s and frequency f leaves an error of at
most sqrt(2) s / (pi f T) in the mean of T seconds: 3e-3 rad at 0.4 Hz over 10 s leave 3e-4 rad, what an
inclinometer's mount is known to, and a second-order change of tension of s^2 / 2, far below a load cell's
gain. That angle is the limit here; every channel's own limit follows from it. Hum above some hertz averages
out and is no motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig_identification.errors import InputError
from rig_identification.recording import Array, Recording, Series
from rig_identification.rig import Rig

#: rad, rms about the mean.
LARGEST_SWING = 3e-3
#: Hz, a frequency above those of most rigs' swing, to turn the angle into a rate.
_SWING_FREQUENCY = 0.5
_BLOCK = 0.25  # s, means over it keep a swing and take out hum and noise
#: Second differences see noise, not swing, at this rate and above.
_NOISE_RATE = 10.0  # Hz


@dataclass(frozen=True)
class _Signal:
    name: str
    unit: str
    limit: float  # rms about the mean
    series: Series
    columns: slice


def check_rest(recording: Recording, rig: Rig, where: str) -> None:
    """Refuse a static recording in which a channel swings or drifts beyond its limit.

    Raises
    ------
    InputError
        Names ``where`` (the bag), channel, value, limit and what to do.
    """
    motion = first_motion(recording, rig)
    if motion is not None:
        raise InputError(
            f"{where}: static recording moves: {motion}; let the body settle and record again, "
            "or make it kind: dynamic"
        )


def first_motion(recording: Recording, rig: Rig) -> str | None:
    """What swings or drifts beyond its limit, by how much; None where the body hangs at rest."""
    for signal in _signals(recording, rig):
        for part in signal.series.parts(signal.columns):
            motion = slow_motion(part.series.time, part.series.values)
            largest = int(np.argmax(motion))
            if motion[largest] > signal.limit:
                width = signal.series.values[:, signal.columns].shape[1]
                axis = part.components[largest] % 3
                label = f"{signal.name} {'xyz'[axis]}" if width > 1 else signal.name
                return (
                    f"{label} varies by {motion[largest]:.3g} {signal.unit} rms, "
                    f"limit {signal.limit:.3g} {signal.unit}"
                )
    return None


def slow_motion(time: Array, values: Array) -> Array:
    """Rms about the mean of what is slower than some hertz, less the share of white noise.

    Parameters
    ----------
    time : (n,) s
    values : (n, width)

    Returns
    -------
    (width,) in the unit of ``values``
    """
    if len(time) < 3:
        return np.zeros(values.shape[1])
    block = np.floor((time - time[0]) / _BLOCK).astype(np.int64)
    _, member, counts = np.unique(block, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(member, column) for column in (values - values.mean(axis=0)).T])
    variance = np.average((sums / counts) ** 2, axis=1, weights=counts)
    if (len(time) - 1) / (time[-1] - time[0]) >= _NOISE_RATE:
        # White noise of variance v has second differences of variance 6 v, and block means of v / count.
        variance = variance - np.mean(np.diff(values, n=2, axis=0) ** 2, axis=0) / 6.0 * len(counts) / len(
            time
        )
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _signals(recording: Recording, rig: Rig) -> Iterator[_Signal]:
    """Every channel that shows motion, with the limit that the largest swing sets it."""
    if recording.imu is not None:
        rate = LARGEST_SWING * 2.0 * np.pi * _SWING_FREQUENCY
        yield _Signal("imu angular rate", "rad/s", rate, recording.imu, slice(0, 3))
        force = LARGEST_SWING * rig.gravity
        yield _Signal("imu specific force", "m/s^2", force, recording.imu, slice(3, 6))
    if recording.inclination is not None:
        yield _Signal("inclination", "rad", LARGEST_SWING, recording.inclination, slice(0, 2))
    weight = sum(float(np.mean(np.abs(series.values))) for series in recording.tension.values())
    for cable, series in recording.tension.items():
        yield _Signal(f"{cable} tension", "N", LARGEST_SWING * weight, series, slice(0, 1))
    if recording.mocap is not None:
        reach = LARGEST_SWING * max(cable.length for cable in rig.cables)
        yield _Signal("mocap position", "m", reach, recording.mocap, slice(0, 3))
        yield _Signal("mocap orientation", "rad", LARGEST_SWING, _turning(recording.mocap), slice(0, 3))


def _turning(mocap: Series) -> Series:
    """(n, 3) small rotations in rad from the first pose: twice the vector part of conj(q_first) q.

    Of a turn that is told about one axis alone nothing is known about the two others (NaN).
    """
    known = np.isfinite(mocap.values[:, 3:7])
    turned = known[:, 3]
    out = np.full((mocap.time.size, 3), np.nan)
    if turned.any():
        q = np.where(known, mocap.values[:, 3:7], 0.0)[turned]
        vector, scalar = q[0, :3], q[0, 3]
        relative = scalar * q[:, :3] - q[:, 3:] * vector - np.cross(vector, q[:, :3])
        sign = np.sign(q @ q[0])[:, None]
        out[turned] = np.where(known[turned, :3], 2.0 * sign * relative, np.nan)
    return Series(mocap.time, out)
