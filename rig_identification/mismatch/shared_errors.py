"""Errors that all cables share: one mistake made many times.

Lengths measured to the wrong point of every fitting, an amplifier's reference voltage, the same edge under
every cable. One number moves all of them, beside what each may be off by itself.
"""

from __future__ import annotations

from rig_identification.estimate.parameters import AXES, Parameter, ParameterSet
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.rig_errors import LENGTH_RANGE
from rig_identification.mismatch.sensor_errors import RANGE
from rig_identification.model import layout
from rig_identification.model.edges import edge_shifts
from rig_identification.model.motion import RigModel
from rig_identification.rig import Rig

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
    """Every cable leaves its ceiling point over an edge of the same radius (model/edges.py)."""
    shifts = edge_shifts(model)
    return Candidate(
        "cable_edge",
        (_shared("cables.edge_radius", "m", RADIUS_RANGE, "physics", shifts),),
        "Every cable bends over an edge of {value} radius where it leaves the ceiling.",
        "Clamp the cables where they leave, or describe the points at which they hang free.",
        {"channel": "ceiling", "axis": None},
        positive=1,
        name_in_result="radius",
    )
