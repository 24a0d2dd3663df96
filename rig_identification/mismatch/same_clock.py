"""A late clock that the stamps themselves contradict.

Devices that one clock samples are stamped on one grid, to the nanosecond; of two clocks not even the rates
agree that well. A device whose own clock is off is off that grid too, unless by a whole number of its
intervals, as a buffer in a driver is. So stamps are a witness with no force and no motion in it: where those
of two devices coincide, a clock that would be off by something else is none, and what is late in the one
device is how it follows (late.py).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import estimates
from rig_identification.mismatch.trial import Trial
from rig_identification.recording import Recording

Array = NDArray[np.float64]

#: Furthest apart (s) that two stamps of one instant lie, and the share of a device's that coincide with
#: another one's where one clock gave both; samples may be missing.
COINCIDE, SHARED = 1e-6, 0.9
#: Std by which a clock has to lie off a whole number of intervals.
OFF = 4.0


def contradicted(clock: Trial) -> bool:
    """Whether stamps say of a trial of a late or early clock that it can be none; of no other trial."""
    if clock.candidate.effect != "clock_offset":
        return False
    (own,) = clock.candidate.parameters
    late, std = estimates(clock.problem, clock.evaluation).of(own.name)
    recordings = {id(run.recording): run.recording for run in clock.problem.runs}.values()
    intervals = [shared_interval(r, str(clock.candidate.where["channel"])) for r in recordings]
    known = [interval for interval in intervals if interval is not None]
    if len(known) < len(intervals):
        return False
    return all(abs(late - interval * round(late / interval)) > OFF * std for interval in known)


def shared_interval(recording: Recording, device: str) -> float | None:
    """Interval (s) of the grid on which one clock stamps a device and another one; None where none does."""
    stamps = dict(_stamps(recording))
    own = stamps.pop(device, None)
    if own is None:
        return None
    steps = [
        min(float(np.median(np.diff(own))), float(np.median(np.diff(other))))
        for other in stamps.values()
        if _coincide(own, other)
    ]
    return min(steps, default=None)


def _stamps(recording: Recording) -> Iterator[tuple[str, Array]]:
    """Devices that are sampled by the rig's own clock or another one, and their stamps (s)."""
    series = {
        **recording.tension,
        "exciter": recording.exciter_force,
        "imu": recording.imu,
        "inclinometer": recording.inclination,
    }
    return ((device, s.time) for device, s in series.items() if s is not None and s.time.size > 1)


def _coincide(one: Array, other: Array) -> bool:
    """Whether nearly all stamps of the slower device, while both measure, are the other one's too."""
    start, end = max(one[0], other[0]) - COINCIDE, min(one[-1], other[-1]) + COINCIDE
    slow, fast = sorted((t[(t >= start) & (t <= end)] for t in (one, other)), key=len)
    if slow.size < 2:
        return False
    after = np.clip(np.searchsorted(fast, slow), 1, fast.size - 1)
    apart = np.minimum(np.abs(fast[after] - slow), np.abs(slow - fast[after - 1]))
    return bool(np.mean(apart < COINCIDE) > SHARED)
