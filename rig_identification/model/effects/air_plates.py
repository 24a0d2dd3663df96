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

from rig_identification.model.arithmetic import root
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.effects.center import center_of_mass, velocity_of
from rig_identification.model.effects.place import PLATE_REACH, PLATES, active
from rig_identification.model.layout import RATE


@njit(cache=True)
def add_air_plates(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of the air on both pairs of plates to r."""
    facing_x, facing_y = physics[block + PLATES], physics[block + PLATES + 1]
    if not (active(facing_x) or active(facing_y)):
        return
    reach = physics[block + PLATE_REACH]
    cx, cy, cz = center_of_mass(physics)
    vx, vy, _ = velocity_of(x, R, cx, cy, cz)
    wz = x[RATE + 2]
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
