"""How the equations of a body on cables answer to its state, written out.

The complex step of integrate.py gives the same numbers; these lines give them ten times faster, for the part
of the equations that every rig has. With the unknowns z = (A, alpha, T) of dynamics.py held,
a change of state changes r - K z by
    body rows:   m dg, h x dg                                 (rotation; dg = d(R^T g) = (R^T g) x tau)
                 -(dw x (w x h) + w x (dw x h)), -(dw x I w + w x I dw)          (rate)
    cable i:     T du in the force rows, T b x du in the moment rows, and in its own row
        rigid    dr + du . A + (b x du) . alpha,  r = u.(w x (w x b)) - (s.s - (u.s)^2)/l
        elastic  EA/L (dl - tau d(u.s)) while it pulls
    ceiling j:   -kappa T d(u.e), and -d(u.e) q'' in a rigid cable's row; e = R^T d its axis
tau = J_r(phi) e is the body-side increment that a change e of the local rotation vector makes
(Sola, "A micro Lie theory", 2018, eq. 143); u, s, l as in dynamics.py, and du = (dD - u (u . dD))/l with D
the line from the body's hinge to the ceiling's.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.cable_line import cable_line, cross, in_body, line_change
from rig_identification.model.effects.internal import moves_hinge
from rig_identification.model.effects.place import EFFECTS_SIZE
from rig_identification.model.layout import (
    AXIAL_DAMPING,
    AXIAL_STIFFNESS,
    AXIS,
    BODY_POINT,
    BODY_STATE,
    CABLE_SIZE,
    CABLES,
    COMPLIANCE,
    ELASTIC,
    GRAVITY,
    INERTIAL,
    INTERNAL_SIZE,
    LENGTH,
    RATE,
    RIGID,
    ROTATION,
    SLACK,
    VELOCITY,
)


@njit(cache=True)
def rotation_increments(x, tau):  # type: ignore[no-untyped-def]
    """tau (3, 3), row k: J_r(phi) e_k as a series, exact to 1e-12 for |phi| < 0.05."""
    a, b, c = x[ROTATION], x[ROTATION + 1], x[ROTATION + 2]
    t = a * a + b * b + c * c
    c2 = 0.5 - t / 24.0 + t * t / 720.0
    c3 = 1.0 / 6.0 - t / 120.0 + t * t / 5040.0
    for k in range(3):
        ex, ey, ez = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)
        px, py, pz = cross(a, b, c, ex, ey, ez)
        qx, qy, qz = cross(a, b, c, px, py, pz)
        tau[k, 0] = ex - c2 * px + c3 * qx
        tau[k, 1] = ey - c2 * py + c3 * qy
        tau[k, 2] = ez - c2 * pz + c3 * qz


@njit(cache=True)
def _add_body_columns(physics, x, R, tau, change):  # type: ignore[no-untyped-def]
    m = physics[INERTIAL]
    hx, hy, hz = physics[INERTIAL + 1], physics[INERTIAL + 2], physics[INERTIAL + 3]
    ixx, ixy, ixz = physics[INERTIAL + 4], physics[INERTIAL + 5], physics[INERTIAL + 6]
    iyy, iyz, izz = physics[INERTIAL + 7], physics[INERTIAL + 8], physics[INERTIAL + 9]
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    g0, g1, g2 = physics[GRAVITY], physics[GRAVITY + 1], physics[GRAVITY + 2]
    gx, gy, gz = in_body(R, g0, g1, g2)
    ax, ay, az = cross(wx, wy, wz, hx, hy, hz)
    lx = ixx * wx + ixy * wy + ixz * wz
    ly = ixy * wx + iyy * wy + iyz * wz
    lz = ixz * wx + iyz * wy + izz * wz
    for k in range(3):
        dx, dy, dz = cross(gx, gy, gz, tau[k, 0], tau[k, 1], tau[k, 2])
        change[0, ROTATION + k] += m * dx
        change[1, ROTATION + k] += m * dy
        change[2, ROTATION + k] += m * dz
        nx, ny, nz = cross(hx, hy, hz, dx, dy, dz)
        change[3, ROTATION + k] += nx
        change[4, ROTATION + k] += ny
        change[5, ROTATION + k] += nz
        ex, ey, ez = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)
        px, py, pz = cross(ex, ey, ez, ax, ay, az)
        qx, qy, qz = cross(ex, ey, ez, hx, hy, hz)
        sx, sy, sz = cross(wx, wy, wz, qx, qy, qz)
        change[0, RATE + k] -= px + sx
        change[1, RATE + k] -= py + sy
        change[2, RATE + k] -= pz + sz
        px, py, pz = cross(ex, ey, ez, lx, ly, lz)
        ix = ixx * ex + ixy * ey + ixz * ez
        iy = ixy * ex + iyy * ey + iyz * ez
        iz = ixz * ex + iyz * ey + izz * ez
        sx, sy, sz = cross(wx, wy, wz, ix, iy, iz)
        change[3, RATE + k] -= px + sx
        change[4, RATE + k] -= py + sy
        change[5, RATE + k] -= pz + sz


@njit(cache=True)
def _add_cable_columns(physics, modes, i, x, R, tau, z, change):  # type: ignore[no-untyped-def]
    n, mode = modes.shape[0], modes[i]
    internal = (x.shape[0] - BODY_STATE) // 2
    block = CABLES + CABLE_SIZE * n + EFFECTS_SIZE
    o = CABLES + CABLE_SIZE * i
    row = 6 + i
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    u, (fx, fy, fz), (vx, vy, vz), (ex, ey, ez), s, length = cable_line(physics, n, i, x, R)
    ux, uy, uz = u
    sx, sy, sz = s
    bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
    per_length = 1.0 / length
    along = ux * sx + uy * sy + uz * sz
    across = (sx * sx + sy * sy + sz * sz - along * along) * per_length
    cx, cy, cz = cross(wx, wy, wz, ex, ey, ez)
    tension = z[row]
    rigid = mode == RIGID
    unloaded = physics[o + LENGTH]
    stiffness = 0.0
    damping = physics[o + AXIAL_DAMPING]
    if not rigid:
        stiffness = physics[o + AXIAL_STIFFNESS] / unloaded
        if mode == ELASTIC and (length - unloaded - damping * along < 0.0 or length < unloaded):
            stiffness = 0.0
    for column in range(BODY_STATE + 2 * internal):
        k = column % 3
        # What the change does to the line to the ceiling, to the hinge's velocity, to the rate
        dx, dy, dz, px, py, pz, qx, qy, qz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if column < ROTATION:
            dx, dy, dz = -R[k, 0], -R[k, 1], -R[k, 2]
        elif column < VELOCITY:
            dx, dy, dz = cross(fx, fy, fz, tau[k, 0], tau[k, 1], tau[k, 2])
            px, py, pz = cross(vx, vy, vz, tau[k, 0], tau[k, 1], tau[k, 2])
        elif column < RATE:
            px, py, pz = R[k, 0], R[k, 1], R[k, 2]
        elif column >= BODY_STATE:
            own = block + INTERNAL_SIZE * ((column - BODY_STATE) % internal)
            if not moves_hinge(physics, own, i):
                continue
            rx, ry, rz = in_body(R, physics[own + AXIS], physics[own + AXIS + 1], physics[own + AXIS + 2])
            if column < BODY_STATE + internal:
                dx, dy, dz = rx, ry, rz
            else:
                px, py, pz = -rx, -ry, -rz
        else:
            qx, qy, qz = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)
            px, py, pz = cross(qx, qy, qz, bx, by, bz)
        longer, (tx, ty, tz), faster = line_change(u, s, length, (dx, dy, dz), (px, py, pz))
        placed = column < VELOCITY or BODY_STATE <= column < BODY_STATE + internal
        if placed:
            mx, my, mz = cross(bx, by, bz, tx, ty, tz)
            change[0, column] += tension * tx
            change[1, column] += tension * ty
            change[2, column] += tension * tz
            change[3, column] += tension * mx
            change[4, column] += tension * my
            change[5, column] += tension * mz
            if rigid:
                change[row, column] += tx * z[0] + ty * z[1] + tz * z[2]
                change[row, column] += mx * z[3] + my * z[4] + mz * z[5]
        if rigid:
            total = tx * cx + ty * cy + tz * cz
            total -= 2.0 * (sx * px + sy * py + sz * pz - along * faster) * per_length
            total += across * longer * per_length
            if RATE <= column < BODY_STATE:
                ax, ay, az = cross(qx, qy, qz, ex, ey, ez)
                total += ux * ax + uy * ay + uz * az
                # d(w x b) is all that the rate does to the hinge's velocity
                ax, ay, az = cross(wx, wy, wz, px, py, pz)
                total += ux * ax + uy * ay + uz * az
            change[row, column] += total
        else:
            change[row, column] += stiffness * (longer - damping * faster)
        if not placed:
            continue
        # How far the cable's pull acts along a ceiling's axis
        for j in range(internal):
            own = block + INTERNAL_SIZE * j
            if not moves_hinge(physics, own, i):
                continue
            rx, ry, rz = in_body(R, physics[own + AXIS], physics[own + AXIS + 1], physics[own + AXIS + 2])
            turned = rx * tx + ry * ty + rz * tz
            if ROTATION <= column < VELOCITY:
                ax, ay, az = cross(rx, ry, rz, tau[k, 0], tau[k, 1], tau[k, 2])
                turned += ux * ax + uy * ay + uz * az
            change[6 + n + j, column] -= physics[own + COMPLIANCE] * turned * tension
            if rigid:
                change[row, column] -= turned * z[6 + n + j]


@njit(cache=True)
def body_and_cable_columns(physics, modes, x, R, z, change):  # type: ignore[no-untyped-def]
    """change (6 + n + s, 12 + 2 s): derivative of r - K z in each entry of the local state, z held.

    physics, modes: see layout.py. x (12 + 2 s,): local state; R (3, 3): pose; z (6 + n + s,). Of the
    effects it holds only that a yielding ceiling moves the upper hinges.
    """
    tau = np.empty((3, 3))
    rotation_increments(x, tau)
    change[:, :] = 0.0
    _add_body_columns(physics, x, R, tau, change)
    for i in range(modes.shape[0]):
        if modes[i] != SLACK:
            _add_cable_columns(physics, modes, i, x, R, tau, z, change)
