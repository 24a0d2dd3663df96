"""Motion that the body does not show: masses that ride on it, and a ceiling that yields.

Each internal coordinate q moves along a fixed direction d and adds its acceleration to the
unknowns of dynamics.py. Those of one mass share the numbers of their leader; a part on springs
may have another frequency f along each direction.

A rider of mass m rests at a (body axes) and is displaced to rho = a + sum d_k q_k. Its own
equation along d_j, divided by m so that it holds for a massless passenger as well,
    d_j . (A + alpha x rho + w x (w x rho) + 2 w x rho' + sum d_k q_k'' - (g - g_rest))
        = -(2 pi f)^2 q_j - 2 zeta 2 pi f d_j . sum d_k q_k'
g_rest is gravity as the body feels it in its rest pose, where the rider's spring bears it. What is loose
has no such spring: g stands for g - g_rest, and on a floor that is not level it lies against a stop.
The body's ten numbers count the rider as fixed at a, so that the body feels the difference:
point inertia and weight at rho less those at a, m 2 w x rho', and m d_k q_k''.
A liquid's first mode is a pendulum of length l = g/(2 pi f)^2 (Ibrahim, "Liquid Sloshing Dynamics",
2005, section 5.2): a rider with two coordinates along d_1 and d_2 that hangs instead of riding on
springs, so that it rises along n = d_1 x d_2 by l - s, s = (l^2 - q^2)^1/2, as it swings:
    rho = a + sum d_k q_k + n (l - s),   t_k = d rho/d q_k = d_k + n q_k/s
t_k stands for d_k above (what damps it works along its path), g for g - g_rest, nothing for the
spring, and the acceleration of rho gains n (q'.q'/s + (q.q')^2/s^3).

A rider that is no point may turn on its springs as well: turning.py.

A ceiling moves all upper hinges, or one alone, by d q. With compliance kappa = 1/k and f = (k/M)^(1/2)/2 pi
    q''/(2 pi f)^2 + 2 zeta q'/(2 pi f) + q = -kappa sum T_i u_i . d
which is a ceiling that does not feel the cables where kappa is zero. The sum is over the cables whose hinges
it moves.
"""

from __future__ import annotations

import math

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.place import EFFECTS_SIZE, REFERENCE_ROTATION, active
from rig_identification.model.effects.point_mass import add_point_inertia
from rig_identification.model.effects.turning import add_turning
from rig_identification.model.layout import (
    AXIS,
    BODY_STATE,
    CABLE_SIZE,
    CABLES,
    CEILING,
    COMPLIANCE,
    DAMPING_RATIO,
    FREQUENCY,
    GRAVITY,
    HINGE,
    INTERNAL_SIZE,
    KIND,
    LEADER,
    MASS,
    PENDULUM,
    POINT,
    RATE,
    RIDER,
    STOP,
    STOP_DAMPING,
)

#: Stops are springs on which the rider would swing at this frequency (Hz).
STOP_FREQUENCY = 20.0


@njit(cache=True)
def moves_hinge(physics, o, cable):  # type: ignore[no-untyped-def]
    """Whether the internal coordinate of the block at ``o`` is a ceiling that moves a cable's upper hinge."""
    hinge = physics[o + HINGE].real
    return physics[o + KIND].real == CEILING and (hinge == 0.0 or hinge == cable + 1.0)


@njit(cache=True)
def ceiling_shift(physics, cables, x, cable):  # type: ignore[no-untyped-def]
    """Displacement and velocity (world) of a cable's upper hinge, six numbers."""
    nothing = 0.0 * x[0]
    s0, s1, s2, v0, v1, v2 = nothing, nothing, nothing, nothing, nothing, nothing
    count = (x.shape[0] - BODY_STATE) // 2
    for j in range(count):
        o = CABLES + CABLE_SIZE * cables + EFFECTS_SIZE + INTERNAL_SIZE * j
        if moves_hinge(physics, o, cable):
            q, speed = x[BODY_STATE + j], x[BODY_STATE + count + j]
            s0 += physics[o + AXIS] * q
            s1 += physics[o + AXIS + 1] * q
            s2 += physics[o + AXIS + 2] * q
            v0 += physics[o + AXIS] * speed
            v1 += physics[o + AXIS + 1] * speed
            v2 += physics[o + AXIS + 2] * speed
    return s0, s1, s2, v0, v1, v2


@njit(cache=True)
def add_ceiling(physics, cables, x, R, cable, ux, uy, uz, rigid, K):  # type: ignore[no-untyped-def]
    """Couple one cable of direction u (body axes) with the ceiling's coordinates in K."""
    count = (x.shape[0] - BODY_STATE) // 2
    w0 = R[0, 0] * ux + R[0, 1] * uy + R[0, 2] * uz
    w1 = R[1, 0] * ux + R[1, 1] * uy + R[1, 2] * uz
    w2 = R[2, 0] * ux + R[2, 1] * uy + R[2, 2] * uz
    for j in range(count):
        o = CABLES + CABLE_SIZE * cables + EFFECTS_SIZE + INTERNAL_SIZE * j
        if moves_hinge(physics, o, cable):
            along = physics[o + AXIS] * w0 + physics[o + AXIS + 1] * w1 + physics[o + AXIS + 2] * w2
            row = 6 + cables + j
            K[row, 6 + cable] += physics[o + COMPLIANCE] * along
            if rigid:
                K[6 + cable, row] += along


@njit(cache=True)
def _stop_force(q, speed, stop, ratio):  # type: ignore[no-untyped-def]
    """Acceleration with which a stop pushes a rider back."""
    omega = 2.0 * math.pi * STOP_FREQUENCY
    nothing = 0.0 * q
    beyond = nothing
    if q.real > stop.real:
        beyond = q - stop
    elif q.real < -stop.real:
        beyond = q + stop
    else:
        return nothing
    return -omega * omega * beyond - 2.0 * ratio * omega * speed


@njit(cache=True)
def _add_rider(physics, block, first, cables, leader, x, R, K, r):  # type: ignore[no-untyped-def]
    """All coordinates of the rider whose leader is ``leader``."""
    count = (x.shape[0] - BODY_STATE) // 2
    lead = first + INTERNAL_SIZE * leader
    mass = physics[lead + MASS]
    omega = 2.0 * math.pi * physics[lead + FREQUENCY]
    zeta, stop = physics[lead + DAMPING_RATIO], physics[lead + STOP]
    ax, ay, az = physics[lead + POINT], physics[lead + POINT + 1], physics[lead + POINT + 2]
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    g0, g1, g2 = physics[GRAVITY], physics[GRAVITY + 1], physics[GRAVITY + 2]
    gx = R[0, 0] * g0 + R[1, 0] * g1 + R[2, 0] * g2
    gy = R[0, 1] * g0 + R[1, 1] * g1 + R[2, 1] * g2
    gz = R[0, 2] * g0 + R[1, 2] * g1 + R[2, 2] * g2
    t = block + REFERENCE_ROTATION
    bx = gx - (physics[t] * g0 + physics[t + 3] * g1 + physics[t + 6] * g2)
    by = gy - (physics[t + 1] * g0 + physics[t + 4] * g1 + physics[t + 7] * g2)
    bz = gz - (physics[t + 2] * g0 + physics[t + 5] * g1 + physics[t + 8] * g2)
    px, py, pz = ax, ay, az
    nothing = 0.0 * ax
    sx, sy, sz = nothing, nothing, nothing
    nx, ny, nz, per_s = nothing, nothing, nothing, nothing
    qx, qy, qz = nothing, nothing, nothing
    hangs = physics[lead + PENDULUM].real > 0.0
    if hangs or stop.real > 0.0:
        # No spring bears its weight
        bx, by, bz = gx, gy, gz
    if hangs:
        o, p = lead, lead + INTERNAL_SIZE
        nx = physics[o + AXIS + 1] * physics[p + AXIS + 2] - physics[o + AXIS + 2] * physics[p + AXIS + 1]
        ny = physics[o + AXIS + 2] * physics[p + AXIS] - physics[o + AXIS] * physics[p + AXIS + 2]
        nz = physics[o + AXIS] * physics[p + AXIS + 1] - physics[o + AXIS + 1] * physics[p + AXIS]
        q0, q1 = x[BODY_STATE + leader], x[BODY_STATE + leader + 1]
        v0, v1 = x[BODY_STATE + count + leader], x[BODY_STATE + count + leader + 1]
        arm = root(g0 * g0 + g1 * g1 + g2 * g2) * reciprocal(omega * omega)
        below = arm * arm - q0 * q0 - q1 * q1
        if below.real < 0.05 * arm.real * arm.real:
            # Past the horizontal no liquid swings: hold the geometry there
            below = 0.05 * arm * arm
        s = root(below)
        per_s = reciprocal(s)
        px, py, pz = px + nx * (arm - s), py + ny * (arm - s), pz + nz * (arm - s)
        slope = (q0 * v0 + q1 * v1) * per_s
        sx, sy, sz = nx * slope, ny * slope, nz * slope
        curving = (v0 * v0 + v1 * v1 + slope * slope) * per_s
        qx, qy, qz = nx * curving, ny * curving, nz * curving
    for k in range(leader, count):
        o = first + INTERNAL_SIZE * k
        if physics[o + KIND].real != RIDER or int(physics[o + LEADER].real) != leader:
            continue
        q, speed = x[BODY_STATE + k], x[BODY_STATE + count + k]
        px += physics[o + AXIS] * q
        py += physics[o + AXIS + 1] * q
        pz += physics[o + AXIS + 2] * q
        sx += physics[o + AXIS] * speed
        sy += physics[o + AXIS + 1] * speed
        sz += physics[o + AXIS + 2] * speed
    # Acceleration of the passenger that does not answer to A, alpha, q''
    ex, ey, ez = wy * pz - wz * py, wz * px - wx * pz, wx * py - wy * px
    ex, ey, ez = ex + 2.0 * sx, ey + 2.0 * sy, ez + 2.0 * sz
    cx, cy, cz = wy * ez - wz * ey + qx, wz * ex - wx * ez + qy, wx * ey - wy * ex + qz
    if active(mass):
        add_point_inertia(mass, px, py, pz, wx, wy, wz, K, r)
        add_point_inertia(-mass, ax, ay, az, wx, wy, wz, K, r)
        # Weight at rho less weight at a; Coriolis
        dx, dy, dz = px - ax, py - ay, pz - az
        fx, fy, fz = (
            -mass * (2.0 * (wy * sz - wz * sy) + qx),
            -mass * (2.0 * (wz * sx - wx * sz) + qy),
            -mass * (2.0 * (wx * sy - wy * sx) + qz),
        )
        r[0] += fx
        r[1] += fy
        r[2] += fz
        r[3] += mass * (dy * gz - dz * gy) + py * fz - pz * fy
        r[4] += mass * (dz * gx - dx * gz) + pz * fx - px * fz
        r[5] += mass * (dx * gy - dy * gx) + px * fy - py * fx
    for j in range(leader, count):
        o = first + INTERNAL_SIZE * j
        if physics[o + KIND].real != RIDER or int(physics[o + LEADER].real) != leader:
            continue
        row = 6 + cables + j
        rise = x[BODY_STATE + j] * per_s
        dx, dy, dz = (
            physics[o + AXIS] + nx * rise,
            physics[o + AXIS + 1] + ny * rise,
            physics[o + AXIS + 2] + nz * rise,
        )
        mx, my, mz = py * dz - pz * dy, pz * dx - px * dz, px * dy - py * dx
        K[row, 0] = dx
        K[row, 1] = dy
        K[row, 2] = dz
        K[row, 3] = mx
        K[row, 4] = my
        K[row, 5] = mz
        K[0, row] = mass * dx
        K[1, row] = mass * dy
        K[2, row] = mass * dz
        K[3, row] = mass * mx
        K[4, row] = mass * my
        K[5, row] = mass * mz
        for k in range(leader, count):
            p = first + INTERNAL_SIZE * k
            if physics[p + KIND].real == RIDER and int(physics[p + LEADER].real) == leader:
                rise = x[BODY_STATE + k] * per_s
                K[row, 6 + cables + k] = (
                    dx * (physics[p + AXIS] + nx * rise)
                    + dy * (physics[p + AXIS + 1] + ny * rise)
                    + dz * (physics[p + AXIS + 2] + nz * rise)
                )
        q, speed = x[BODY_STATE + j], x[BODY_STATE + count + j]
        along = dx * sx + dy * sy + dz * sz
        omega = 2.0 * math.pi * physics[(lead if physics[o + FREQUENCY].real == 0.0 else o) + FREQUENCY]
        r[row] = dx * (bx - cx) + dy * (by - cy) + dz * (bz - cz) - 2.0 * zeta * omega * along
        if not hangs:
            r[row] -= omega * omega * q
        if stop.real > 0.0:
            r[row] += _stop_force(q, speed, stop, physics[lead + STOP_DAMPING])


@njit(cache=True)
def add_internal(physics, block, modes, x, R, K, r):  # type: ignore[no-untyped-def]
    """Add the equations of all internal coordinates to K and r."""
    count = (x.shape[0] - BODY_STATE) // 2
    cables = modes.shape[0]
    first = block + EFFECTS_SIZE
    for j in range(count):
        o = first + INTERNAL_SIZE * j
        if physics[o + KIND].real == CEILING:
            row = 6 + cables + j
            omega = 2.0 * math.pi * physics[o + FREQUENCY]
            K[row, row] = 1.0 / (omega * omega)
            speed = x[BODY_STATE + count + j]
            r[row] = -x[BODY_STATE + j] - 2.0 * physics[o + DAMPING_RATIO] / omega * speed
        elif int(physics[o + LEADER].real) == j:
            _add_rider(physics, block, first, cables, j, x, R, K, r)
            add_turning(physics, first, cables, j, x, K, r)
