"""Upper ends that hold a cable as it leans: a loop round a beam, a clamp; or that yield, a slack support.

With e_i the direction of cable i in the world (ceiling to body), f_i the one at rest and q the horizontal
part of e_i - f_i, the end stores 1/2 q' K q, K symmetric: a loop holds in its own plane and leaves the cable
free across it. With l the cable's length that puts the force -(1 - e e') K q / l on the body at its hinge,
and the moment that goes with it on the ceiling. A cable that ends in a loop of height h swings in the loop's
plane as if it were shorter by h: k = T l h/(l - h) under the tension T. With k < 0 an end goes along.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.cable_line import in_body
from rig_identification.model.effects.direction import cable_direction
from rig_identification.model.effects.place import REFERENCE_POSITION, REFERENCE_ROTATION
from rig_identification.model.effects.point import force_at
from rig_identification.model.layout import BODY_POINT, CABLE_SIZE, CABLES, LEAN, SLACK


@njit(cache=True)
def add_held_ends(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of some cables' upper ends to r."""
    t, p = block + REFERENCE_ROTATION, block + REFERENCE_POSITION
    rest = physics[t : t + 9].reshape(3, 3)
    for i in range(cables[0], cables[1]):
        if modes[i] == SLACK:
            continue
        o = CABLES + CABLE_SIZE * i
        xx, xy, yy = physics[o + LEAN], physics[o + LEAN + 1], physics[o + LEAN + 2]
        fx, fy, fz, _ = cable_direction(physics, o, physics[p], physics[p + 1], physics[p + 2], rest)
        ex, ey, ez, per_length = cable_direction(physics, o, x[0], x[1], x[2], R)
        qx = R[0, 0] * ex + R[0, 1] * ey + R[0, 2] * ez
        qy = R[1, 0] * ex + R[1, 1] * ey + R[1, 2] * ez
        qx -= rest[0, 0] * fx + rest[0, 1] * fy + rest[0, 2] * fz
        qy -= rest[1, 0] * fx + rest[1, 1] * fy + rest[1, 2] * fz
        gx, gy, gz = in_body(R, -(xx * qx + xy * qy) * per_length, -(xy * qx + yy * qy) * per_length, 0.0)
        along = gx * ex + gy * ey + gz * ez
        bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
        force_at(bx, by, bz, gx - along * ex, gy - along * ey, gz - along * ez, r)
