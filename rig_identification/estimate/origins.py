"""A session described about origins of its own, near the rig, and what was found told about the given ones.

Nothing depends on where a lab puts the room's corner or the body's datum. Numbers do: moments of inertia
about a datum thirty metres off are a thousand times those about the centre of mass, and a small turn of the
body about it moves every hinge by centimetres. So far origins are moved to the middle of the hinges first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.joint import Doubt, JointInformation
from rig_identification.recording import Recording, Session
from rig_identification.result import BodyMotion, Finding, Identification, InertialEstimate, ParameterEstimate
from rig_identification.rig import Mount, Rig

Array = NDArray[np.float64]

#: An origin is far where it is this many times the rig's size away from the middle of its hinges.
FAR = 2.0
#: Parameters (the part of the name before the axis) that are places in the body and in the world.
IN_BODY = ("body_point", "position", "point")
IN_WORLD = ("ceiling_point",)
#: Devices of which the error of a place is estimated, not the place.
ERRORS_ONLY = ("imu", "mocap")


@dataclass(frozen=True)
class Origins:
    """Where the origins used lie, in the given frames."""

    body: Array  # (3,) m
    world: Array  # (3,) m

    @property
    def given(self) -> bool:
        """Whether they are the given ones."""
        return not (np.any(self.body) or np.any(self.world))


def near_origins(rig: Rig) -> Origins:
    """The given origins, or the middle of the hinges where they lie far off it."""
    ceiling = np.array([cable.ceiling_point for cable in rig.cables])
    body = np.array([cable.body_point for cable in rig.cables])
    size = max(cable.length for cable in rig.cables)
    size = max(size, *(float(np.max(np.ptp(points, axis=0))) for points in (ceiling, body)))

    def chosen(points: Array) -> Array:
        middle = np.mean(points, axis=0)
        return middle if np.linalg.norm(middle) > FAR * size else np.zeros(3)

    return Origins(chosen(body), chosen(ceiling))


def moved(session: Session, origins: Origins) -> Session:
    """The same session, described about other origins."""
    rig = session.rig
    cables = tuple(
        replace(c, ceiling_point=c.ceiling_point - origins.world, body_point=c.body_point - origins.body)
        for c in rig.cables
    )
    frame = rig.frame
    if frame is not None:
        frame = replace(frame, center_of_mass=frame.center_of_mass - origins.body)

    def mounted(mount: Mount | None) -> Mount | None:
        return None if mount is None else replace(mount, position=mount.position - origins.body)

    rig = replace(
        rig,
        cables=cables,
        frame=frame,
        imu=mounted(rig.imu),
        exciter=mounted(rig.exciter),
        mocap=mounted(rig.mocap),
    )

    def carried(recording: Recording) -> Recording:
        dummy = recording.dummy
        if dummy is None:
            return recording
        return replace(recording, dummy=replace(dummy, position=dummy.position - origins.body))

    return replace(session, rig=rig, recordings=tuple(carried(r) for r in session.recordings))


def told(found: Identification, origins: Origins) -> Identification:
    """What was found about ``origins``, told about the given ones."""
    without = found.without_frame
    mismatch = found.mismatch
    figures = {
        name: told(value, origins) if isinstance(value, Identification) else value
        for name, value in found.figures.items()
    }
    return replace(
        found,
        total=_body(found.total, origins),
        without_frame=None if without is None else _body(without, origins),
        mismatch=replace(
            mismatch,
            findings=tuple(_finding(f, origins) for f in mismatch.findings),
            alternatives=tuple(_alternative(a, origins) for a in mismatch.alternatives),
        ),
        parameters=tuple(_parameter(p, origins) for p in found.parameters),
        figures=figures,
        joint=None if found.joint is None else _joint(found.joint, origins),
        motions=tuple(_motion(m, origins) for m in found.motions),
    )


def _motion(motion: BodyMotion, origins: Origins) -> BodyMotion:
    """Where the given datum is: the one used lies at ``origins.body`` in the given axes."""
    turned = Rotation.from_quat(motion.orientation).apply(origins.body)
    return replace(motion, position=motion.position + origins.world - turned)


def _body(estimate: InertialEstimate, origins: Origins) -> InertialEstimate:
    """Only the centre of mass is a place; a constant added to it leaves the covariance as it is."""
    values = estimate.values.copy()
    values[1:4] += origins.body
    return replace(estimate, values=values)


def _parameter(parameter: ParameterEstimate, origins: Origins) -> ParameterEstimate:
    shift = _shift(parameter.name, origins)
    return replace(parameter, nominal=parameter.nominal + shift, value=parameter.value + shift)


def _shift(name: str, origins: Origins) -> float:
    """By how much a parameter's number grows that is told about the given origins, m."""
    device, *_, kind, axis = ("", "", *name.split("."))[-3:]
    origin = origins.body if kind in IN_BODY else origins.world if kind in IN_WORLD else None
    return 0.0 if origin is None or device in ERRORS_ONLY else float(origin["xyz".index(axis)])


def _joint(joint: JointInformation, origins: Origins) -> JointInformation:
    """Places alone move, by a constant: the information stays as it is."""

    def doubt(d: Doubt) -> Doubt:
        return replace(d, nominal=d.nominal + _shift(d.name, origins))

    frame = joint.frame
    if frame is not None:
        frame = replace(frame, center_of_mass=frame.center_of_mass + origins.body)
    in_body, beside = np.concatenate([origins.body, np.zeros(4)]), {"inclinometer": 0.0}
    elements = joint.elements.copy()
    elements[1:4] += origins.body
    return replace(
        joint,
        elements=elements,
        doubts=tuple(map(doubt, joint.doubts)),
        frame=frame,
        ceiling={cable: point + origins.world for cable, point in joint.ceiling.items()},
        mounts={name: mount + beside.get(name, 1.0) * in_body for name, mount in joint.mounts.items()},
    )


def _finding(finding: Finding, origins: Origins) -> Finding:
    where, parameters = dict(finding.where), dict(finding.parameters)
    place = where.get("position")
    if isinstance(place, list):
        where["position"] = [float(v + o) for v, o in zip(place, origins.body, strict=True)]
    for i, axis in enumerate("xyz"):
        entry = parameters.get(f"position_{axis}", {})
        value = entry.get("value")
        if isinstance(value, float):
            parameters[f"position_{axis}"] = {**entry, "value": value + float(origins.body[i])}
    return replace(finding, where=where, parameters=parameters, numbers=_numbers(finding.numbers, origins))


def _alternative(alternative: Mapping[str, object], origins: Origins) -> dict[str, object]:
    numbers = alternative.get("numbers")
    if not isinstance(numbers, Mapping):
        return dict(alternative)
    return {**alternative, "numbers": _numbers(numbers, origins)}


def _numbers(numbers: Mapping[str, tuple[float, float]], origins: Origins) -> dict[str, tuple[float, float]]:
    return {name: (value + _shift(name, origins), std) for name, (value, std) in numbers.items()}
