"""Air against a body's sides: plates a reach r from its centre of mass, two facing its x and two its y axis.

Each resists the air along its own normal with the square of its own speed there, 1/2 rho (C/2) |u| u, C being
drag coefficient times area of both plates of a pair. The pair that faces x stands at +-r along y and moves
at u = v_x -+ r w_z. Where the body only turns, the two forces make a moment 1/2 rho C r^3 |w| w. Where it
swings slowly while it turns fast, they make a force rho C r |w| v against the swing, linear in v: a swing
that hardly moves the air dies away by what the turn stirs, and no longer when the turn is gone. A force on
the whole body's speed (air_drag.py) and a moment on its rate alone know nothing of that.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.effects.place import PLATE_REACH, PLATES, active
from rig_identification.model.layout import INERTIAL, RATE, VELOCITY


@njit(cache=True)
def add_air_plates(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of the air on both pairs of plates to r."""
    facing_x, facing_y = physics[block + PLATES], physics[block + PLATES + 1]
    if not (active(facing_x) or active(facing_y)):
        return
    reach = physics[block + PLATE_REACH]
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
    for side in (-reach, reach):
        # 1e-12 m^2/s^2 keeps the root's derivative finite at rest
        u = vx - wz * side
        force = -0.25 * AIR * facing_x * root(u * u + 1e-12) * u
        r[0] += force
        r[4] += cz * force
        r[5] -= (cy + side) * force
        u = vy + wz * side
        force = -0.25 * AIR * facing_y * root(u * u + 1e-12) * u
        r[1] += force
        r[3] -= cz * force
        r[5] += (cx + side) * force
