"""Cables that weigh: each a straight uniform rod, hinged at both ends.

A rod of mass m_c along e that turns about its ceiling hinge presses across itself on the body with
    F = P (m_c/2 g - m_c/3 a),   P = 1 - e e^T,   a: acceleration of the lower hinge
(its moment of inertia about the upper hinge is m_c l^2/3, its weight acts at l/2). Along
itself it pulls with T at the body; at the ceiling T + m_c e.g + m_c l |O|^2 / 2 arrives.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.direction import cable_direction
from rig_identification.model.effects.place import LINEAR_DENSITY, active
from rig_identification.model.effects.point import force_at
from rig_identification.model.layout import (
    BODY_POINT,
    CABLE_SIZE,
    CABLES,
    CEILING_POINT,
    CELL_AT_CEILING,
    GRAVITY,
    LENGTH,
    RATE,
    SLACK,
    VELOCITY,
)


@njit(cache=True)
def add_cable_mass(physics, block, modes, cables, x, R, K, r):  # type: ignore[no-untyped-def]
    """Add weight and inertia of some cables across themselves to K and r."""
    density = physics[block + LINEAR_DENSITY]
    if not active(density):
        return
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    g0, g1, g2 = physics[GRAVITY], physics[GRAVITY + 1], physics[GRAVITY + 2]
    gx = R[0, 0] * g0 + R[1, 0] * g1 + R[2, 0] * g2
    gy = R[0, 1] * g0 + R[1, 1] * g1 + R[2, 1] * g2
    gz = R[0, 2] * g0 + R[1, 2] * g1 + R[2, 2] * g2
    for i in range(cables[0], cables[1]):
        if modes[i] == SLACK:
            continue
        o = CABLES + CABLE_SIZE * i
        mass = density * physics[o + LENGTH]
        bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
        ex, ey, ez, _ = cable_direction(physics, o, x[0], x[1], x[2], R)
        # Right side: m/2 P g - m/3 P (w x (w x b))
        tx, ty, tz = wy * bz - wz * by, wz * bx - wx * bz, wx * by - wy * bx
        qx = 0.5 * gx - (wy * tz - wz * ty) * (1.0 / 3.0)
        qy = 0.5 * gy - (wz * tx - wx * tz) * (1.0 / 3.0)
        qz = 0.5 * gz - (wx * ty - wy * tx) * (1.0 / 3.0)
        along = ex * qx + ey * qy + ez * qz
        fx, fy, fz = mass * (qx - along * ex), mass * (qy - along * ey), mass * (qz - along * ez)
        force_at(bx, by, bz, fx, fy, fz, r)
        # Left side: m/3 P (A + alpha x b), columns of A then of alpha
        third = mass * (1.0 / 3.0)
        for j in range(6):
            if j == 0:
                ux, uy, uz = 1.0 + 0.0 * ex, 0.0 * ex, 0.0 * ex
            elif j == 1:
                ux, uy, uz = 0.0 * ex, 1.0 + 0.0 * ex, 0.0 * ex
            elif j == 2:
                ux, uy, uz = 0.0 * ex, 0.0 * ex, 1.0 + 0.0 * ex
            elif j == 3:
                ux, uy, uz = 0.0 * ex, -bz, by
            elif j == 4:
                ux, uy, uz = bz, 0.0 * ex, -bx
            else:
                ux, uy, uz = -by, bx, 0.0 * ex
            along = ex * ux + ey * uy + ez * uz
            px, py, pz = third * (ux - along * ex), third * (uy - along * ey), third * (uz - along * ez)
            K[0, j] += px
            K[1, j] += py
            K[2, j] += pz
            K[3, j] += by * pz - bz * py
            K[4, j] += bz * px - bx * pz
            K[5, j] += bx * py - by * px


@njit(cache=True)
def weight_below_cell(physics, block, modes, i, x, R):  # type: ignore[no-untyped-def]
    """What cable i's own mass adds at a load cell at its ceiling end to the tension at the body, N."""
    density = physics[block + LINEAR_DENSITY]
    o = CABLES + CABLE_SIZE * i
    if not active(density) or modes[i] == SLACK or physics[o + CELL_AT_CEILING].real == 0.0:
        return 0.0 * density
    bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
    d = x[0] * 0.0
    length = x[0] * 0.0
    speed = x[0] * 0.0
    along = x[0] * 0.0
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    tx, ty, tz = wy * bz - wz * by, wz * bx - wx * bz, wx * by - wy * bx
    for j in range(3):
        e = x[j] + R[j, 0] * bx + R[j, 1] * by + R[j, 2] * bz - physics[o + CEILING_POINT + j]
        s = x[VELOCITY + j] + R[j, 0] * tx + R[j, 1] * ty + R[j, 2] * tz
        d += e * physics[GRAVITY + j]
        length += e * e
        speed += s * s
        along += e * s
    per = reciprocal(root(length))
    # |O|^2 = (|s|^2 - (e.s)^2) / l^2; half the rod's centripetal force arrives besides its weight
    spin = (speed - along * along * per * per) * per * per
    unloaded = physics[o + LENGTH]
    return density * unloaded * (d * per + 0.5 * unloaded * spin)
