"""Air that sides of the body carry along: inertia without weight, another one along each of the body's axes.

A flat side takes the air before it along where it moves across itself, and hardly any where it moves along
itself: pi/4 rho a^2 b of a long strip of width a, at its middle. With D = diag(m_x, m_y, m_z) and u the
velocity of the place in body axes the air's energy is u^T D u / 2 and its momentum D u, so that it resists
with the force D du/dt + w x D u there and the moment u x D u (Lamb, "Hydrodynamics", 1932, art. 124).
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.center import velocity_of
from rig_identification.model.effects.place import AIR_CARRIED, AIR_CARRIED_POINT
from rig_identification.model.layout import RATE


@njit(cache=True)
def add_air_carried(physics, block, x, R, K, r):  # type: ignore[no-untyped-def]
    """Add the air's inertia to K and r: du/dt = A + alpha x p + w x (w x p) - w x u."""
    m, p = block + AIR_CARRIED, block + AIR_CARRIED_POINT
    mx, my, mz = physics[m], physics[m + 1], physics[m + 2]
    px, py, pz = physics[p], physics[p + 1], physics[p + 2]
    K[0, 0] += mx
    K[1, 1] += my
    K[2, 2] += mz
    # D E with alpha x p = E alpha, and E^T D E
    K[0, 4] += mx * pz
    K[0, 5] -= mx * py
    K[1, 3] -= my * pz
    K[1, 5] += my * px
    K[2, 3] += mz * py
    K[2, 4] -= mz * px
    K[4, 0] += mx * pz
    K[5, 0] -= mx * py
    K[3, 1] -= my * pz
    K[5, 1] += my * px
    K[3, 2] += mz * py
    K[4, 2] -= mz * px
    K[3, 3] += my * pz * pz + mz * py * py
    K[4, 4] += mx * pz * pz + mz * px * px
    K[5, 5] += mx * py * py + my * px * px
    K[3, 4] -= mz * px * py
    K[4, 3] -= mz * px * py
    K[3, 5] -= my * px * pz
    K[5, 3] -= my * px * pz
    K[4, 5] -= mx * py * pz
    K[5, 4] -= mx * py * pz
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    ux, uy, uz = velocity_of(x, R, px, py, pz)
    # w x p - u: less the velocity of the datum
    vx, vy, vz = wy * pz - wz * py - ux, wz * px - wx * pz - uy, wx * py - wy * px - uz
    gx, gy, gz = mx * ux, my * uy, mz * uz
    fx = mx * (wy * vz - wz * vy) + wy * gz - wz * gy
    fy = my * (wz * vx - wx * vz) + wz * gx - wx * gz
    fz = mz * (wx * vy - wy * vx) + wx * gy - wy * gx
    r[0] -= fx
    r[1] -= fy
    r[2] -= fz
    r[3] -= py * fz - pz * fy + uy * gz - uz * gy
    r[4] -= pz * fx - px * fz + uz * gx - ux * gz
    r[5] -= px * fy - py * fx + ux * gy - uy * gx
