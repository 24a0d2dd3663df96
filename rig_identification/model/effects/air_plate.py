"""Air against one plate: a flat side, a wing, a sail at a place of the body.

It resists along its normal n alone: a body with such a side is braked along one axis, and turned where the
place is off the line through its centre of mass. With u = n . v of its place and w the speed along the plate
the force is 1/2 rho Cd A sqrt(u^2 + s^2 w^2) u. A plate that air meets at an angle is pushed by sin(angle)
times the square of all of the speed while the air follows it (s = 1), and by the square of u alone once it
does not (s = 0). The normal is (cos e cos a, cos e sin a, sin e).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.arithmetic import root
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.effects.center import velocity_of
from rig_identification.model.effects.place import (
    AIR_PLATE,
    AIR_PLATE_ALONG,
    AIR_PLATE_NORMAL,
    AIR_PLATE_POINT,
)
from rig_identification.model.effects.point import force_at


@njit(cache=True)
def add_air_plate(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add the plate's force to r."""
    area = physics[block + AIR_PLATE]
    azimuth, elevation = physics[block + AIR_PLATE_NORMAL], physics[block + AIR_PLATE_NORMAL + 1]
    p = block + AIR_PLATE_POINT
    px, py, pz = physics[p], physics[p + 1], physics[p + 2]
    level, nz = np.cos(elevation), np.sin(elevation)
    nx, ny = level * np.cos(azimuth), level * np.sin(azimuth)
    vx, vy, vz = velocity_of(x, R, px, py, pz)
    u = nx * vx + ny * vy + nz * vz
    share = physics[block + AIR_PLATE_ALONG]
    square = u * u + share * share * (vx * vx + vy * vy + vz * vz - u * u)
    # 1e-12 m^2/s^2 keeps the root's derivative finite at rest
    force = -0.5 * AIR * area * root(square + 1e-12) * u
    force_at(px, py, pz, force * nx, force * ny, force * nz, r)
