"""Geometry beyond what the lab believes: lengths, hinges and the level of the ceiling."""

from __future__ import annotations

from collections.abc import Callable

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import AXES, ParameterSet
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.mismatch.sensor_errors import freed
from rig_identification.rig import Rig

#: Plausible range of a length or hinge error (m), and of the ceiling's tilt (rad).
LENGTH_RANGE = 0.03
TILT_RANGE = 0.05


def _level(rig: Rig, parameters: ParameterSet) -> list[Candidate]:
    out = []
    # Gravity gains g t along world y where the ceiling is turned by +t about x, and loses it along x about y
    for axis, entry, sign in (("x", "y", -1.0), ("y", "x", 1.0)):
        p = freed(parameters, f"level.{entry}", rig.gravity * TILT_RANGE)
        if p is None:
            continue

        def angle(found: Estimates, name: str = p.name, sign: float = sign) -> Told:
            return {"angle": (*found.following(lambda aside: sign * aside / rig.gravity, name), "rad")}

        out.append(
            Candidate(
                "level_error",
                (p,),
                f"The ceiling points are tilted by {{value}} about the world's {axis} axis.",
                "Level the ceiling points again with a water level.",
                {"channel": "ceiling", "axis": axis},
                tell=angle,
            )
        )
    return out


def rig_errors(rig: Rig, parameters: ParameterSet) -> list[Candidate]:
    """All geometry errors of this rig."""
    out = []
    for cable in rig.cables:
        length = freed(parameters, f"{cable.name}.length", LENGTH_RANGE)
        if length is not None:
            out.append(
                Candidate(
                    "cable_length",
                    (length,),
                    "{channel} is longer than described by {value}.",
                    "Measure the cable between its hinge centres under load.",
                    {"channel": cable.name, "axis": None},
                    tell=error_of(length.name, cable.length),
                )
            )
        for end, point in (("ceiling", cable.ceiling_point), ("body", cable.body_point)):
            for i, a in enumerate(AXES):
                p = freed(parameters, f"{cable.name}.{end}_point.{a}", LENGTH_RANGE)
                if p is not None:
                    out.append(
                        Candidate(
                            "hinge_position",
                            (p,),
                            f"The {end} hinge of {{channel}} sits {{value}} off its description, along {a}.",
                            "Measure the hinge's place again.",
                            {"channel": cable.name, "end": end, "axis": a},
                            tell=error_of(p.name, float(point[i])),
                        )
                    )
    return [*out, *_level(rig, parameters)]


def error_of(name: str, nominal: float) -> Callable[[Estimates], Told]:
    """Tells a length less what the description says of it."""

    def told(found: Estimates) -> Told:
        return {"error": (*found.following(lambda value: value - nominal, name), "m")}

    return told
