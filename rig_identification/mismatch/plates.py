"""Air against one flat side of the body, at a place and facing a direction that are tried (place_scan.py)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import AXES
from rig_identification.mismatch.candidate import Candidate, added
from rig_identification.mismatch.place_scan import Scales, direction, point_near_middle
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.motion import Motion, RigModel
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Cd A that is believed to be possible, in squares of the rig's longest side; std (rad) of a normal's angles.
AREA, FACING = 3.0, 0.5
#: Name of the amount: one side is in a model at most.
AREA_NAME = "air.plate_area"
#: How far air along a side counts at first (air_plate.py): between not at all, 0, and as all other, 1.
ALONG = 0.7
#: Directions (azimuth, elevation, rad) that a side is tried to face: along each axis, and between two.
NORMALS = (
    (0.0, 0.0), (0.5 * np.pi, 0.0), (0.0, 0.5 * np.pi), (0.25 * np.pi, 0.0), (-0.25 * np.pi, 0.0),
    (0.0, 0.25 * np.pi), (0.0, -0.25 * np.pi), (0.5 * np.pi, 0.25 * np.pi), (0.5 * np.pi, -0.25 * np.pi),
)  # fmt: skip
#: What to do about the air.
DRAG_ADVICE = "Keep speeds low, cover or take off what catches the air, or keep the drag in the model."


@dataclass(frozen=True)
class Plate:
    """A side that faces ``normal``: azimuth and elevation in the body, rad."""

    normal: tuple[float, float]

    @property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Its drag area."""
        return (("plate_area", "m^2"),)

    def candidate(self, rig: Rig, scales: Scales) -> Candidate:
        """The hypothesis of a side that faces about there."""
        block = layout.effects_offset(len(rig.cables))
        area = added(AREA_NAME, "m^2", AREA * scales.size**2, block + place.AIR_PLATE)
        angles = tuple(
            added(f"air.plate_{name}", "rad", FACING, block + place.AIR_PLATE_NORMAL + i, self.normal[i])
            for i, name in enumerate(("azimuth", "elevation"))
        )
        point = point_near_middle("air_drag", rig, 0.3 * scales.size, place.AIR_PLATE_POINT)
        along = added("air.plate_along", "1", 0.5, block + place.AIR_PLATE_ALONG, ALONG)
        axis = AXES[int(np.argmax(np.abs(direction(*self.normal))))]
        return Candidate(
            "air_drag",
            (area, *angles, *point, along),
            f"The air resists at a flat side that faces {axis}, with the square of speed along that: a drag "
            "area of {value}.",
            DRAG_ADVICE,
            {"channel": None, "axis": axis},
            positive=1,
            name_in_result="drag_area",
            curved=True,
        )

    def values(self, candidate: Candidate, at: Array, amounts: Array, scales: Scales) -> dict[str, float]:
        """Values of its parameters at the place ``at``."""
        area = candidate.parameters[0]
        known = {f"air_drag.point.{a}": float(at[i]) for i, a in enumerate(AXES)}
        known |= {"air.plate_azimuth": self.normal[0], "air.plate_elevation": self.normal[1]}
        return {area.name: area.value(float(amounts[0])), **known}

    def makes_sense(self, amounts: Array) -> bool:
        """Whether it brakes."""
        return bool(amounts[0] > 0.0)

    def wrenches(self, model: RigModel, motion: Motion, at: Array, scales: Scales) -> Array:
        """(N, 6, 1) wrench about the datum, body axes, of a std of its area (model/effects/air_plate.py)."""
        x, n = motion.states, direction(*self.normal)
        v = np.einsum("nji,nj->ni", motion.R_world_body, x[:, layout.VELOCITY : layout.VELOCITY + 3])
        v = v + np.cross(x[:, layout.RATE : layout.RATE + 3], at)
        u = v @ n
        speed = np.sqrt(u**2 + ALONG**2 * (np.sum(v**2, axis=1) - u**2))
        size = -0.5 * AIR * AREA * scales.size**2 * speed * u
        return np.asarray(size[:, None, None] * np.concatenate([n, np.cross(at, n)])[:, None])


#: Sides that are tried at every place.
PLATES = tuple(Plate(normal) for normal in NORMALS)
