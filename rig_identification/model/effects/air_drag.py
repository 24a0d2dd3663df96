"""Air drag: a force at the centre of mass against the square of its speed, 1/2 rho Cd A |v| v."""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import root
from rig_identification.model.effects.center import center_of_mass, velocity_of
from rig_identification.model.effects.place import DRAG_AREA, active
from rig_identification.model.effects.point import force_at

#: Density of air, kg/m^3 (recording contract).
AIR = 1.2


@njit(cache=True)
def add_air_drag(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add drag to r."""
    area = physics[block + DRAG_AREA]
    if not active(area):
        return
    cx, cy, cz = center_of_mass(physics)
    vx, vy, vz = velocity_of(x, R, cx, cy, cz)
    # 1e-12 m^2/s^2 keeps the root's derivative finite at rest
    factor = -0.5 * AIR * area * root(vx * vx + vy * vy + vz * vz + 1e-12)
    force_at(cx, cy, cz, factor * vx, factor * vy, factor * vz, r)
