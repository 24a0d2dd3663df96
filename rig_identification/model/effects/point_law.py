"""A force at a point of the body that follows the point's motion by a law that no other effect has.

With q the point, u = q - q0 its travel from where it hangs at rest (a constant of the session) and v its
velocity, all in the world,
    F = -(k1 s + k2 s^2 + k3 s^3) d - (c1 + c2 |v|) exp(-n |u|^2) v / (1 + w |v|^2),    s = d . u
where the brake counts the part of v across d by a, and the vertical part by h: both 1 to all sides, h = 0 for
what slides over a level plane, a = 0 for what brakes along the line d alone (a dashpot, a slide in a slot).
The first part is a spring along the line d that hardens, softens or pushes (a magnet, a bush, a belt); it
keeps energy, its potential being k1 s^2/2 + k2 s^3/3 + k3 s^4/4. The second is a brake to all sides that may
fade with distance (an eddy-current brake, a rubbing brush, a sail away from the centre of mass) or saturate:
an eddy-current brake pulls most at the speed 1/sqrt(w), and dry friction no more at any speed above that
(c2/w). With c1, c2 >= 0 it only takes energy out. d = (cos e cos a, cos e sin a, sin e), azimuth a and
elevation e.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.center import velocity_of
from rig_identification.model.effects.place import (
    LAW_ACROSS,
    LAW_BRAKE,
    LAW_DIRECTION,
    LAW_NARROW,
    LAW_POINT,
    LAW_SATURATION,
    LAW_SPRING,
    LAW_UPRIGHT,
    active,
)
from rig_identification.model.effects.point import force_at, push_at, travel


@njit(cache=True)
def add_point_law(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add the law's force to r."""
    k, c = block + LAW_SPRING, block + LAW_BRAKE
    springs = active(physics[k]) or active(physics[k + 1]) or active(physics[k + 2])
    brakes = active(physics[c]) or active(physics[c + 1])
    if not (springs or brakes):
        return
    point = block + LAW_POINT
    ux, uy, uz = travel(physics, block, LAW_POINT, x, R)
    azimuth, elevation = physics[block + LAW_DIRECTION], physics[block + LAW_DIRECTION + 1]
    level = np.cos(elevation)
    dx, dy, dz = level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)
    if springs:
        s = dx * ux + dy * uy + dz * uz
        force = -(physics[k] + (physics[k + 1] + physics[k + 2] * s) * s) * s
        push_at(physics, point, R, force * dx, force * dy, force * dz, r)
    if brakes:
        bx, by, bz = velocity_of(x, R, physics[point], physics[point + 1], physics[point + 2])
        # Less what of its vertical part does not count
        less = (1.0 - physics[block + LAW_UPRIGHT]) * (R[2, 0] * bx + R[2, 1] * by + R[2, 2] * bz)
        bx, by, bz = bx - less * R[2, 0], by - less * R[2, 1], bz - less * R[2, 2]
        across = physics[block + LAW_ACROSS]
        ex = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
        ey = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
        ez = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
        along = (1.0 - across) * (ex * bx + ey * by + ez * bz)
        bx, by, bz = across * bx + along * ex, across * by + along * ey, across * bz + along * ez
        # 1e-12 m^2/s^2 keeps the root's derivative finite at rest
        speed = root(bx * bx + by * by + bz * bz + 1e-12)
        fade = np.exp(-physics[block + LAW_NARROW] * (ux * ux + uy * uy + uz * uz))
        fade = fade * reciprocal(1.0 + physics[block + LAW_SATURATION] * speed * speed)
        factor = -(physics[c] + physics[c + 1] * speed) * fade
        ax, ay, az = physics[point], physics[point + 1], physics[point + 2]
        force_at(ax, ay, az, factor * bx, factor * by, factor * bz, r)
