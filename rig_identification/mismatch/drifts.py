"""Zeros and gains that move while a recording lasts, which the contract's table has no word for.

A load cell, an amplifier, a gyroscope that warms up: each recording's zero is what it was when the recording
began, and moves at a rate that may settle (model/sensors.drift). A bridge that warms up moves its gain alike:
what hangs still tells the two apart as little as one reading does, what swings by as much as it swings. What
moves differently in each recording is no law: the held-out run refutes it.
"""

from __future__ import annotations

import numpy as np

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import AXES, Parameter, ParameterSet
from rig_identification.estimate.wander import GAINS, wander_of
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.model import sensors
from rig_identification.rig import Rig

#: Axes of a device that may drift: what they measure, its unit, and a plausible rate (std of the prior).
CELL = (("tension", None, "N", 2.0),)
IMU = (
    *(("angular_rate", a, "rad/s", 5e-4) for a in AXES),
    *(("specific_force", a, "m/s^2", 5e-3) for a in AXES),
)
INCLINOMETER = tuple(("inclination", a, "rad", 5e-4) for a in "xy")
#: How fast drifts settle, 1/s: from hardly within a recording to within seconds.
SETTLING, SETTLING_SPREAD = 0.05, 0.1
#: Plausible rate of a gain (std of the prior), 1/s: half a percent in ten seconds.
GAIN = 5e-4
#: By what name the result has a drift, of what it is, and what to do.
ZERO = ("drift", "zero", "Let it warm up before recording, and zero it then.")
SCALE = ("gain_drift", "gain", "Let it warm up before recording, and calibrate it then.")


def drifts(rig: Rig, parameters: ParameterSet, devices: list[str], duration: float) -> list[Candidate]:
    """What each axis of the ``devices`` may drift by. duration: s, of a recording."""
    fixed = {"imu": IMU, "inclinometer": INCLINOMETER}
    out, laws = [], parameters.places.laws()
    for device in devices:
        cell = CELL if device in parameters.places.cables else ()
        for quantity, axis, unit, std in fixed.get(device, cell):
            name = f"{device}.drift" if axis is None else f"{device}.{quantity}.drift.{axis}"
            rate, settling = name, f"{name}.settling"
            own = (
                Parameter(rate, f"{unit}/s", 0.0, std, "device", laws[rate], bounded=False),
                Parameter(
                    settling, "1/s", SETTLING, SETTLING_SPREAD, "device", laws[settling], bounded=False
                ),
            )
            where: dict[str, object] = {"channel": device, "axis": axis, "quantity": quantity, "law": "drift"}
            lasts = max(duration, 1.0)
            out.append(_drift(own, unit, duration, where, wander_of(rig, quantity) / lasts, ZERO))
            of_gain = Parameter(
                f"{name}.gain", "1/s", 0.0, GAIN, "device", laws[f"{name}.gain"], bounded=False
            )
            where = {**where, "law": "gain drift"}
            known = wander_of(rig, quantity, GAINS) / lasts
            out.append(_drift((of_gain, own[1]), "1", duration, where, known, SCALE))
    return out


def _drift(
    own: tuple[Parameter, Parameter],
    unit: str,
    duration: float,
    where: dict[str, object],
    ordinary: float,
    words: tuple[str, str, str],
) -> Candidate:
    """A drift. ordinary: rate at which every such number wanders in a recording; words: how it is told."""
    rate, settling = own
    name, what, advice = words

    def moved(at_first: float, settles: float) -> float:
        device = np.array([at_first, settles, 0.0])
        return float(sensors.drift(np.array([duration]), device).zero[0, 0])

    def told(found: Estimates) -> Told:
        return {
            name: (*found.following(moved, rate.name, settling.name), unit),
            "settling_rate": (*found.of(settling.name), "1/s"),
        }

    which = f"{str(where['quantity']).replace('_', ' ')} {where['axis'] or ''}".strip()
    return Candidate(
        "unknown",
        own,
        f"The {what} of {{channel}}'s {which} drifts: by {{value}} in {duration:.3g} s.",
        advice,
        where,
        tell=told,
        ordinary={rate.name: ordinary},
    )
