"""Motion that the body does not show: masses that ride on it, and a ceiling that yields.

Each internal coordinate q moves along a fixed direction d and adds its acceleration to the
unknowns of dynamics.py. Those of one mass share the numbers of their leader.

A rider of mass m rests at a (body axes) and is displaced to rho = a + sum d_k q_k. Its own
equation along d_j, divided by m so that it holds for a massless passenger as well,
    d_j . (A + alpha x rho + w x (w x rho) + 2 w x rho' + sum d_k q_k'' - (g - g_rest))
        = -(2 pi f)^2 q_j - 2 zeta 2 pi f q_j'
g_rest is gravity as the body feels it in its rest pose, where the rider's spring bears it.
The body's ten numbers count the rider as fixed at a, so that the body feels the difference:
point inertia and weight at rho less those at a, m 2 w x rho', and m d_k q_k''.
A linear pendulum of length g/(2 pi f)^2 and a mass on horizontal springs obey the same
equation: a liquid's first mode is a rider with two horizontal coordinates (Ibrahim,
"Liquid Sloshing Dynamics", 2005, section 5.2).

A ceiling moves all upper hinges by d q. With compliance kappa = 1/k and f = (k/M)^(1/2)/2 pi
    q''/(2 pi f)^2 + 2 zeta q'/(2 pi f) + q = -kappa sum T_i u_i . d
which is a ceiling that does not feel the cables where kappa is zero.
"""

from __future__ import annotations

import math

from numba import njit

from rig_identification.model.effects.place import EFFECTS_SIZE, REFERENCE_ROTATION, active
from rig_identification.model.effects.point_mass import add_point_inertia
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
    INTERNAL_SIZE,
    KIND,
    LEADER,
    MASS,
    POINT,
    RATE,
    STOP,
)

#: Stops are springs that are this much stiffer than what turns a mass of 1 Hz, and damp like 0.1 of critical.
STOP_FREQUENCY = 12.0
STOP_DAMPING = 0.1


@njit(cache=True)
def ceiling_shift(physics, cables, x):  # type: ignore[no-untyped-def]
    """Displacement and velocity (world) of the upper hinges, six numbers."""
    nothing = 0.0 * x[0]
    s0, s1, s2, v0, v1, v2 = nothing, nothing, nothing, nothing, nothing, nothing
    count = (x.shape[0] - BODY_STATE) // 2
    for j in range(count):
        o = CABLES + CABLE_SIZE * cables + EFFECTS_SIZE + INTERNAL_SIZE * j
        if physics[o + KIND].real == CEILING:
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
        if physics[o + KIND].real == CEILING:
            along = physics[o + AXIS] * w0 + physics[o + AXIS + 1] * w1 + physics[o + AXIS + 2] * w2
            row = 6 + cables + j
            K[row, 6 + cable] += physics[o + COMPLIANCE] * along
            if rigid:
                K[6 + cable, row] += along


@njit(cache=True)
def _stop_force(q, speed, stop):  # type: ignore[no-untyped-def]
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
    return -omega * omega * beyond - 2.0 * STOP_DAMPING * omega * speed


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
    sx, sy, sz = 0.0 * ax, 0.0 * ax, 0.0 * ax
    for k in range(leader, count):
        o = first + INTERNAL_SIZE * k
        if physics[o + KIND].real == CEILING or int(physics[o + LEADER].real) != leader:
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
    cx, cy, cz = wy * ez - wz * ey, wz * ex - wx * ez, wx * ey - wy * ex
    if active(mass):
        add_point_inertia(mass, px, py, pz, wx, wy, wz, K, r)
        add_point_inertia(-mass, ax, ay, az, wx, wy, wz, K, r)
        # Weight at rho less weight at a; Coriolis
        dx, dy, dz = px - ax, py - ay, pz - az
        fx, fy, fz = (
            -2.0 * mass * (wy * sz - wz * sy),
            -2.0 * mass * (wz * sx - wx * sz),
            -2.0 * mass * (wx * sy - wy * sx),
        )
        r[0] += fx
        r[1] += fy
        r[2] += fz
        r[3] += mass * (dy * gz - dz * gy) + py * fz - pz * fy
        r[4] += mass * (dz * gx - dx * gz) + pz * fx - px * fz
        r[5] += mass * (dx * gy - dy * gx) + px * fy - py * fx
    for j in range(leader, count):
        o = first + INTERNAL_SIZE * j
        if physics[o + KIND].real == CEILING or int(physics[o + LEADER].real) != leader:
            continue
        row = 6 + cables + j
        dx, dy, dz = physics[o + AXIS], physics[o + AXIS + 1], physics[o + AXIS + 2]
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
            if physics[p + KIND].real != CEILING and int(physics[p + LEADER].real) == leader:
                K[row, 6 + cables + k] = (
                    dx * physics[p + AXIS] + dy * physics[p + AXIS + 1] + dz * physics[p + AXIS + 2]
                )
        q, speed = x[BODY_STATE + j], x[BODY_STATE + count + j]
        r[row] = (
            dx * (bx - cx) + dy * (by - cy) + dz * (bz - cz) - omega * omega * q - 2.0 * zeta * omega * speed
        )
        if stop.real > 0.0:
            r[row] += _stop_force(q, speed, stop)


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
