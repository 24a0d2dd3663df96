"""How the equations of a body on cables answer to the rig's numbers, written out.

As state_columns.py for the state: the complex step gives the same numbers, these lines give them several
times faster. With the unknowns z = (A, alpha, T) of dynamics.py held and a = R^T g - A, r - K z changes by
    gravity:   m R^T dg, h x R^T dg
    mass:      a dm                                                             (force rows)
    h:         -w x (w x dh) - alpha x dh,  dh x a
    I:         -w x (dI w) - dI alpha                                           (moment rows)
    exciter:   f = k (1 + rho x + rho x rho x / 2) M F at e: de x f, and df, e x df
    cable i:   with du = (dD - u (u . dD))/l, dD = R^T dc of the ceiling's hinge and -db of the body's:
               T du, T (db x u + b x du), and its own row
        rigid      du . A + (db x u + b x du) . alpha + dr
        elastic    EA/L (dl - tau d(u.s)), and by its length, stiffness and damping, while it pulls
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.cable_line import cable_line, cross, hinge_change, in_body, line_change
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
    EXCITER_GAIN,
    EXCITER_POSITION,
    EXCITER_ROTATION,
    GRAVITY,
    INERTIAL,
    INTERNAL_SIZE,
    LENGTH,
    RATE,
    RIGID,
    SLACK,
)


@njit(cache=True)
def add_body_number(physics, direction, x, R, z, change):  # type: ignore[no-untyped-def]
    """Add to change (6 + n + s,) the derivative in gravity or in one of the ten inertial numbers."""
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    if direction < INERTIAL:
        k = direction - GRAVITY
        m = physics[INERTIAL]
        gx, gy, gz = R[k, 0], R[k, 1], R[k, 2]
        tx, ty, tz = cross(physics[INERTIAL + 1], physics[INERTIAL + 2], physics[INERTIAL + 3], gx, gy, gz)
        change[0] += m * gx
        change[1] += m * gy
        change[2] += m * gz
        change[3] += tx
        change[4] += ty
        change[5] += tz
        return
    gx, gy, gz = in_body(R, physics[GRAVITY], physics[GRAVITY + 1], physics[GRAVITY + 2])
    ax, ay, az = gx - z[0], gy - z[1], gz - z[2]
    k = direction - INERTIAL
    if k == 0:
        change[0] += ax
        change[1] += ay
        change[2] += az
    elif k < 4:
        ex, ey, ez = 1.0 * (k == 1), 1.0 * (k == 2), 1.0 * (k == 3)
        px, py, pz = cross(wx, wy, wz, ex, ey, ez)
        px, py, pz = cross(wx, wy, wz, px, py, pz)
        qx, qy, qz = cross(z[3], z[4], z[5], ex, ey, ez)
        tx, ty, tz = cross(ex, ey, ez, ax, ay, az)
        change[0] -= px + qx
        change[1] -= py + qy
        change[2] -= pz + qz
        change[3] += tx
        change[4] += ty
        change[5] += tz
    else:
        # Ixx, Ixy, Ixz, Iyy, Iyz, Izz: rows and columns of the symmetric unit
        i = 0 if k < 7 else (1 if k < 9 else 2)
        j = k - 4 if k < 7 else (k - 6 if k < 9 else 2)
        lx, ly, lz = 0.0, 0.0, 0.0
        bx, by, bz = 0.0, 0.0, 0.0
        for turn in range(1 if i == j else 2):
            row, column = (i, j) if turn == 0 else (j, i)
            w, alpha = x[RATE + column], z[3 + column]
            lx += w * (row == 0)
            ly += w * (row == 1)
            lz += w * (row == 2)
            bx += alpha * (row == 0)
            by += alpha * (row == 1)
            bz += alpha * (row == 2)
        tx, ty, tz = cross(wx, wy, wz, lx, ly, lz)
        change[3] -= tx + bx
        change[4] -= ty + by
        change[5] -= tz + bz


@njit(cache=True)
def add_exciter_number(physics, mount, direction, force, force_rate, change):  # type: ignore[no-untyped-def]
    """Add the derivative in one of the exciter's numbers; below 0: in its clock, with ``force_rate``."""
    if direction < 0:
        f0, f1, f2 = in_body(mount.T, force_rate[0], force_rate[1], force_rate[2])
    else:
        f0, f1, f2 = in_body(mount.T, force[0], force[1], force[2])
    gain = physics[EXCITER_GAIN]
    a, b, c = physics[EXCITER_ROTATION], physics[EXCITER_ROTATION + 1], physics[EXCITER_ROTATION + 2]
    px, py, pz = physics[EXCITER_POSITION], physics[EXCITER_POSITION + 1], physics[EXCITER_POSITION + 2]
    t0, t1, t2 = cross(a, b, c, f0, f1, f2)
    if EXCITER_ROTATION <= direction < EXCITER_ROTATION + 3:
        k = direction - EXCITER_ROTATION
        ex, ey, ez = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)
        q0, q1, q2 = cross(ex, ey, ez, f0, f1, f2)
        s0, s1, s2 = cross(ex, ey, ez, t0, t1, t2)
        u0, u1, u2 = cross(a, b, c, q0, q1, q2)
        fx, fy, fz = (
            gain * (q0 + 0.5 * (s0 + u0)),
            gain * (q1 + 0.5 * (s1 + u1)),
            gain * (q2 + 0.5 * (s2 + u2)),
        )
    else:
        s0, s1, s2 = cross(a, b, c, t0, t1, t2)
        fx, fy, fz = f0 + t0 + 0.5 * s0, f1 + t1 + 0.5 * s1, f2 + t2 + 0.5 * s2
        if direction != EXCITER_GAIN:
            fx, fy, fz = gain * fx, gain * fy, gain * fz
    if EXCITER_POSITION <= direction < EXCITER_POSITION + 3:
        k = direction - EXCITER_POSITION
        tx, ty, tz = cross(1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2), fx, fy, fz)
    else:
        change[0] += fx
        change[1] += fy
        change[2] += fz
        tx, ty, tz = cross(px, py, pz, fx, fy, fz)
    change[3] += tx
    change[4] += ty
    change[5] += tz


@njit(cache=True)
def cable_number_columns(physics, modes, i, x, R, z, change):  # type: ignore[no-untyped-def]
    """change (9, 6 + n + s): derivative in each of cable i's first nine numbers."""
    n = modes.shape[0]
    internal = (x.shape[0] - BODY_STATE) // 2
    block = CABLES + CABLE_SIZE * n + EFFECTS_SIZE
    o = CABLES + CABLE_SIZE * i
    row = 6 + i
    change[:, :] = 0.0
    if modes[i] == SLACK:
        return
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    u, _, _, (ex, ey, ez), s, length = cable_line(physics, n, i, x, R)
    ux, uy, uz = u
    sx, sy, sz = s
    bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
    per_length = 1.0 / length
    along = ux * sx + uy * sy + uz * sz
    across = (sx * sx + sy * sy + sz * sz - along * along) * per_length
    cx, cy, cz = cross(wx, wy, wz, ex, ey, ez)
    tension = z[row]
    rigid = modes[i] == RIGID
    unloaded, damping = physics[o + LENGTH], physics[o + AXIAL_DAMPING]
    stretch = length - unloaded - damping * along
    pulls = rigid or modes[i] != ELASTIC or (stretch >= 0.0 and length >= unloaded)
    stiffness = 0.0 if rigid or not pulls else physics[o + AXIAL_STIFFNESS] / unloaded
    if not rigid and pulls:
        change[LENGTH, row] = -stiffness * (1.0 + stretch / unloaded)
        change[AXIAL_STIFFNESS, row] = stretch / unloaded
        change[AXIAL_DAMPING, row] = -stiffness * along
    for number in range(6):
        (hx, hy, hz), line, speed = hinge_change(x, R, number)
        px, py, pz = speed
        longer, (tx, ty, tz), faster = line_change(u, s, length, line, speed)
        mx, my, mz = cross(bx, by, bz, tx, ty, tz)
        ax, ay, az = cross(hx, hy, hz, ux, uy, uz)
        mx, my, mz = mx + ax, my + ay, mz + az
        out = change[number]
        out[0] = tension * tx
        out[1] = tension * ty
        out[2] = tension * tz
        out[3] = tension * mx
        out[4] = tension * my
        out[5] = tension * mz
        if rigid:
            total = tx * z[0] + ty * z[1] + tz * z[2] + mx * z[3] + my * z[4] + mz * z[5]
            total += tx * cx + ty * cy + tz * cz
            qx, qy, qz = cross(wx, wy, wz, px, py, pz)
            total += ux * qx + uy * qy + uz * qz
            total -= 2.0 * (sx * px + sy * py + sz * pz - along * faster) * per_length
            out[row] = total + across * longer * per_length
        else:
            out[row] = stiffness * (longer - damping * faster)
        # How far the cable's pull acts along a ceiling's axis
        for j in range(internal):
            own = block + INTERNAL_SIZE * j
            if not moves_hinge(physics, own, i):
                continue
            rx, ry, rz = in_body(R, physics[own + AXIS], physics[own + AXIS + 1], physics[own + AXIS + 2])
            turned = rx * tx + ry * ty + rz * tz
            out[6 + n + j] = -physics[own + COMPLIANCE] * turned * tension
            if rigid:
                out[row] -= turned * z[6 + n + j]
