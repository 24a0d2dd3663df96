"""Errors that all cables share: one mistake made many times.

Lengths measured to the wrong point of every fitting, an amplifier's reference voltage, the same edge under
every cable. One number moves all of them, beside what each may be off by itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import AXES, Parameter, ParameterSet
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.rig_errors import LENGTH_RANGE
from rig_identification.mismatch.sensor_errors import RANGE
from rig_identification.model import layout
from rig_identification.model.equilibrium import design_pose
from rig_identification.model.motion import RigModel
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Plausible radius (m) of an edge, a ring or a pulley that a cable bends over.
RADIUS_RANGE = 0.05
#: What channel an error of all cables is told of.
ALL = "all"


def shared_errors(rig: Rig, parameters: ParameterSet) -> list[Candidate]:
    """All errors of this rig that its cables share."""
    names = {p.name for p in parameters.free}
    out = []
    if len(rig.cables) > 1 and all(f"{c.name}.length" in names for c in rig.cables):
        out.append(_lengths(parameters.model))
        out.append(_edges(parameters.model))
    cells = [c.name for c in rig.cables if f"{c.name}.load_cell_gain" in names]
    if len(cells) > 1:
        out.append(_gains([parameters.places.load_cell(name) for name in cells]))
    return [*out, *_scales(parameters)]


def _shared(name: str, unit: str, std: float, kind: str, shifts: list[tuple[int, float]]) -> Parameter:
    return Parameter(name, unit, 0.0, std, kind, -1, bounded=False, shifts=tuple(shifts))


def _lengths(model: RigModel) -> Candidate:
    """Every cable is longer by the same."""
    shifts = [(layout.cable_offset(i) + layout.LENGTH, 1.0) for i in range(model.cables)]
    return Candidate(
        "cable_length",
        (_shared("cables.length", "m", LENGTH_RANGE, "physics", shifts),),
        "Every cable is longer than described by {value}.",
        "Measure the cables between their hinge centres under load; all of them end at another point.",
        {"channel": ALL, "axis": None},
        name_in_result="error",
    )


def _gains(cells: list[int]) -> Candidate:
    """Every load cell reads too much by the same share."""
    return Candidate(
        "load_cell_gain",
        (
            _shared(
                "load_cells.gain", "1", RANGE["load_cell_gain"], "device", [(cell, 1.0) for cell in cells]
            ),
        ),
        "All load cells have the same scale error of {value}: they read that share too high.",
        "Check the amplifier's reference and the unit of force, and calibrate with a known weight.",
        {"channel": ALL, "axis": None},
        name_in_result="gain",
    )


def _scales(parameters: ParameterSet) -> list[Candidate]:
    """Every axis of a gyroscope, or of an accelerometer, reads too much by the same share."""
    out = []
    for kind in ("gyroscope", "accelerometer"):
        own = [p.index for p in parameters.free if p.name in {f"imu.{kind}_scale.{a}" for a in AXES}]
        if len(own) == len(AXES):
            shifts = [(index, 1.0) for index in own]
            out.append(
                Candidate(
                    "imu_scale",
                    (_shared(f"imu.{kind}_scale", "1", RANGE[f"{kind}_scale"], "device", shifts),),
                    f"All axes of the {kind} have the same scale error of {{value}}.",
                    "Check its range and the unit that the driver writes, and calibrate it.",
                    {"channel": "imu", "axis": None},
                    name_in_result="scale",
                )
            )
    return out


def _edges(model: RigModel) -> Candidate:
    """Every cable leaves its ceiling point over an edge of the same radius.

    A cable that comes down vertically and leaves at an angle a to that bends over an arc r a of the edge.
    From there it is straight, and swings about the arc's end, which is the centre of curvature of its path:
    the hinge sits r (1 - cos a) to the side and r sin a lower, and the cable is r a shorter. a is taken as
    the cable hangs at rest; while it swings by b more, this is right to the second order in b.
    """
    shifts: list[tuple[int, float]] = []
    for i, down in enumerate(_directions(model)):
        o = layout.cable_offset(i)
        aside = np.array([down[0], down[1], 0.0])
        sine = float(np.linalg.norm(aside))
        angle = float(np.arctan2(sine, -down[2]))
        if sine > 0.0:
            aside /= sine
        moved = (1.0 - np.cos(angle)) * aside - np.sin(angle) * np.array([0.0, 0.0, 1.0])
        shifts += [(o + layout.CEILING_POINT + k, float(moved[k])) for k in range(3)]
        shifts.append((o + layout.LENGTH, -angle))
    return Candidate(
        "cable_edge",
        (_shared("cables.edge_radius", "m", RADIUS_RANGE, "physics", shifts),),
        "Every cable bends over an edge of {value} radius where it leaves the ceiling.",
        "Clamp the cables where they leave, or describe the points at which they hang free.",
        {"channel": "ceiling", "axis": None},
        positive=1,
        name_in_result="radius",
    )


def _directions(model: RigModel) -> Array:
    """(n, 3) unit vectors down the cables, world axes, as the described body hangs."""
    pose, cables = design_pose(model), model.cable_numbers()
    body = cables[:, layout.BODY_POINT : layout.BODY_POINT + 3]
    hinges = pose.position + body @ np.asarray(pose.R_world_body).T
    line = hinges - cables[:, layout.CEILING_POINT : layout.CEILING_POINT + 3]
    return np.asarray(line / np.linalg.norm(line, axis=1)[:, None])
