"""Cables that bend over an edge, a ring or a pulley where they leave the ceiling.

A cable that comes down vertically and leaves at an angle a to that bends over an arc r a of an edge of radius
r. From there it is straight, and swings about the arc's end, which is the centre of curvature of its path:
the hinge sits r (1 - cos a) to the side and r sin a lower, and the cable is r a shorter. a is taken as the
cable hangs at rest; while it swings by b more, this is right to the second order in b.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.model import layout
from rig_identification.model.equilibrium import design_pose
from rig_identification.model.motion import RigModel

Array = NDArray[np.float64]


def edge_shifts(model: RigModel) -> list[tuple[int, float]]:
    """Entries of ``physics`` that a radius moves, each with its change for each metre of radius."""
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
    return shifts


def _directions(model: RigModel) -> Array:
    """(n, 3) unit vectors down the cables, world axes, as the described body hangs."""
    pose, cables = design_pose(model), model.cable_numbers()
    body = cables[:, layout.BODY_POINT : layout.BODY_POINT + 3]
    hinges = pose.position + body @ np.asarray(pose.R_world_body).T
    line = hinges - cables[:, layout.CEILING_POINT : layout.CEILING_POINT + 3]
    return np.asarray(line / np.linalg.norm(line, axis=1)[:, None])
