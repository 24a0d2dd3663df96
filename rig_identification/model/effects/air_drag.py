"""Air drag: a force at the centre of mass against the square of its speed, 1/2 rho Cd A |v| v."""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.place import DRAG_AREA, active
from rig_identification.model.layout import INERTIAL, RATE, VELOCITY

#: Density of air, kg/m^3 (recording contract).
AIR = 1.2


@njit(cache=True)
def add_air_drag(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add drag to r."""
    area = physics[block + DRAG_AREA]
    if not active(area):
        return
    per_mass = reciprocal(physics[INERTIAL])
    cx, cy, cz = (
        physics[INERTIAL + 1] * per_mass,
        physics[INERTIAL + 2] * per_mass,
        physics[INERTIAL + 3] * per_mass,
    )
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    v0, v1, v2 = x[VELOCITY], x[VELOCITY + 1], x[VELOCITY + 2]
    vx = R[0, 0] * v0 + R[1, 0] * v1 + R[2, 0] * v2 + wy * cz - wz * cy
    vy = R[0, 1] * v0 + R[1, 1] * v1 + R[2, 1] * v2 + wz * cx - wx * cz
    vz = R[0, 2] * v0 + R[1, 2] * v1 + R[2, 2] * v2 + wx * cy - wy * cx
    # 1e-12 m^2/s^2 keeps the root's derivative finite at rest
    factor = -0.5 * AIR * area * root(vx * vx + vy * vy + vz * vz + 1e-12)
    fx, fy, fz = factor * vx, factor * vy, factor * vz
    r[0] += fx
    r[1] += fy
    r[2] += fz
    r[3] += cy * fz - cz * fy
    r[4] += cz * fx - cx * fz
    r[5] += cx * fy - cy * fx
