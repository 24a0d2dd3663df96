"""What sits elsewhere, or is turned: all coordinates of a place together.

Whoever measures a place wrongly is seldom wrong along one axis of the body alone. Along one axis it is a
special case, told where it explains as much (rig_errors.py, sensor_errors.py).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import AXES, ParameterSet
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.mismatch.rig_errors import LENGTH_RANGE, error_of
from rig_identification.mismatch.sensor_errors import RANGE, freed, turned
from rig_identification.rig import Rig

_AGAIN = "Measure its place again."


def mount_errors(rig: Rig, parameters: ParameterSet) -> list[Candidate]:
    """Every device and hinge of this rig whose place the lab doubts, and the exciter's orientation."""
    out = _placed(
        parameters, "imu_position", "imu.position", RANGE["position"], "The IMU", {"channel": "imu"}
    )
    out += _placed(
        parameters,
        "exciter_position",
        "exciter.position",
        RANGE["position"],
        "The exciter",
        {"channel": "exciter"},
    )
    for cable in rig.cables:
        for end in ("ceiling", "body"):
            where: dict[str, object] = {"channel": cable.name, "end": end}
            subject = f"The {end} hinge of {{channel}}"
            stem = f"{cable.name}.{end}_point"
            out += _placed(parameters, "hinge_position", stem, LENGTH_RANGE, subject, where)
    out += _exciter_along_one_axis(parameters)
    if rig.exciter is not None:
        orientation = rig.exciter.orientation
        out += turned(parameters, "exciter", "The exciter", "exciter_misalignment", orientation)
    return out


def _placed(
    parameters: ParameterSet,
    effect: str,
    stem: str,
    std: float,
    subject: str,
    where: dict[str, object],
) -> list[Candidate]:
    own = [freed(parameters, f"{stem}.{a}", std) for a in AXES]
    found = tuple(p for p in own if p is not None)
    if len(found) < len(AXES):
        return []
    nominal = {p.name: p.nominal for p in found}

    def off(estimates: Estimates) -> Told:
        errors: Told = {
            f"error_{a}": error_of(p.name, p.nominal)(estimates)["error"]
            for a, p in zip(AXES, found, strict=True)
        }
        size = estimates.following(partial(_distance, *nominal.values()), *nominal)
        return {"error": (*size, "m"), **errors}

    sentence = f"{subject} sits {{value}} from where it is described."
    return [Candidate(effect, found, sentence, _AGAIN, {**where, "axis": None}, tell=off)]


def _distance(x: float, y: float, z: float, *at: float) -> float:
    return float(np.linalg.norm(np.subtract(at, (x, y, z))))


def _exciter_along_one_axis(parameters: ParameterSet) -> list[Candidate]:
    out = []
    for a in AXES:
        p = freed(parameters, f"exciter.position.{a}", RANGE["position"])
        if p is not None:
            out.append(
                Candidate(
                    "exciter_position",
                    (p,),
                    f"The exciter sits {{value}} from where it is described, along the body's {a} axis.",
                    _AGAIN,
                    {"channel": "exciter", "axis": a},
                    tell=error_of(p.name, p.nominal),
                )
            )
    return out
