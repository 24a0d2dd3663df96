"""Readings at rest beside what the description says of them, for people."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.reduced import Reduced
from rig_identification.examination import RestReading
from rig_identification.rig import Rig


def readings_at_rest(evidence: Evidence) -> tuple[RestReading, ...]:
    """Every tension, angle and component of specific force.

    What is expected is the described rig with the body that agrees with all of them best.
    """
    rest = evidence.plain.rest
    if rest is None:
        return ()
    out: list[RestReading] = []
    for recording, expected in zip(evidence.session.at_rest, rest.expected, strict=True):
        for device, column, quantity, axis, unit, std in _described(evidence.session.rig, recording):
            values = recording.values[device][0]
            k = column - (3 if device == "imu" else 0)
            wanted = expected.get(device)
            if wanted is not None and np.isfinite(values[column]):
                zero = evidence.session.rig.tolerance["load_cell_zero"]
                off = float(np.hypot(zero, std * wanted[k])) if unit == "N" else std
                measured = float(values[column])
                out.append(
                    RestReading(recording.name, device, quantity, axis, unit, measured, float(wanted[k]), off)
                )
    return tuple(out)


def _described(rig: Rig, recording: Reduced) -> Iterator[tuple[str, int, str, str | None, str, float]]:
    """Device, column, quantity, axis, unit, and what it may be off by (a share for tensions)."""
    tolerance = rig.tolerance
    for cable in rig.cables:
        if cable.name in recording.values:
            yield cable.name, 0, "tension", None, "N", tolerance["load_cell_gain"]
    if "inclinometer" in recording.values and rig.inclinometer is not None:
        angle = float(np.hypot(tolerance["inclinometer_orientation"], tolerance["level"]))
        for k, axis in enumerate("xy"):
            yield "inclinometer", k, "inclination", axis, "rad", angle
    if "imu" in recording.values and rig.imu is not None:
        force = float(np.hypot(tolerance["accelerometer_bias"], rig.gravity * tolerance["imu_orientation"]))
        for k, axis in enumerate("xyz"):
            yield "imu", 3 + k, "specific_force", axis, "m/s^2", force
