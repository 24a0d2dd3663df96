"""A part on springs that turns on them: a body of its own and no point (effects/internal.py).

A car on its frame, or four wheels that go up and down each by itself, have inertia about their own centre
beside their mass. Coordinate theta_j turns a part about the body axis e_j through the place of its rider,
which is its centre of mass: nothing pulls there but its springs. With theta = sum e_j theta_j, to second
order in small turns,
    w_r = sum t_j theta_j',   t_j = e_j + theta x e_j / 2
is how fast it turns within the body, and P its inertia about its centre, as turned,
    P = S + D,   D = [theta]S - S[theta],   S: as it rests
so that the part's torque is
    N = P (alpha + sum t_j theta_j'') + b,   b = D' (w + w_r) + w x (P (w + w_r))
The body's ten numbers count the part as it rests, so that the body feels N - S alpha - w x (S w) more; and
    t_j . N = -S_jj ((2 pi f_j)^2 theta_j + 2 zeta_j 2 pi f_j theta_j')
which is divided by S_jj, so that no part is too small for it. S is symmetric: of the column of each axis that
turns the entries on and above the diagonal count, and what does not turn has none.
"""

from __future__ import annotations

import math

from numba import njit

from rig_identification.model.arithmetic import reciprocal
from rig_identification.model.layout import (
    AXIS,
    BODY_STATE,
    DAMPING_RATIO,
    FREQUENCY,
    INERTIA,
    INTERNAL_SIZE,
    KIND,
    LEADER,
    RATE,
    TURNING,
)


@njit(cache=True, inline="always")
def _times(p, x, y, z):  # type: ignore[no-untyped-def]
    """A symmetric tensor (xx, xy, xz, yy, yz, zz) times a vector."""
    return p[0] * x + p[1] * y + p[2] * z, p[1] * x + p[3] * y + p[4] * z, p[2] * x + p[4] * y + p[5] * z


@njit(cache=True, inline="always")
def _cross(a, b):  # type: ignore[no-untyped-def]
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, inline="always")
def _turned(s, t):  # type: ignore[no-untyped-def]
    """[t]S - S[t] of a symmetric tensor, which is symmetric as well."""
    x = _cross(t, (s[0], s[1], s[2]))
    y = _cross(t, (s[1], s[3], s[4]))
    z = _cross(t, (s[2], s[4], s[5]))
    return 2.0 * x[0], y[0] + x[1], z[0] + x[2], 2.0 * y[1], z[1] + y[2], 2.0 * z[2]


@njit(cache=True, inline="always")
def _along(physics, o, turn):  # type: ignore[no-untyped-def]
    """What the axis of the block at ``o`` adds to how fast a part turns that is turned by ``turn``."""
    e = (physics[o + AXIS], physics[o + AXIS + 1], physics[o + AXIS + 2])
    c = _cross(turn, e)
    return e[0] + 0.5 * c[0], e[1] + 0.5 * c[1], e[2] + 0.5 * c[2]


@njit(cache=True)
def add_turning(physics, first, cables, leader, x, K, r):  # type: ignore[no-untyped-def]
    """Add all turning coordinates of the rider ``leader`` to K and r.

    first: entry of the first internal coordinate's block. x (12 + 2 s,): local state.
    """
    count = (x.shape[0] - BODY_STATE) // 2
    nothing = 0.0 * physics[first]
    s0, s1, s2, s3, s4, s5 = nothing, nothing, nothing, nothing, nothing, nothing
    a0, a1, a2, v0, v1, v2 = nothing, nothing, nothing, nothing, nothing, nothing
    turns = False
    for k in range(leader + 1, count):
        o = first + INTERNAL_SIZE * k
        if physics[o + KIND].real != TURNING or int(physics[o + LEADER].real) != leader:
            continue
        turns = True
        e0, e1, e2 = physics[o + AXIS], physics[o + AXIS + 1], physics[o + AXIS + 2]
        q, speed = x[BODY_STATE + k], x[BODY_STATE + count + k]
        s0 += physics[o + INERTIA] * e0
        s1 += physics[o + INERTIA] * e1
        s2 += physics[o + INERTIA] * e2
        s3 += physics[o + INERTIA + 1] * e1
        s4 += physics[o + INERTIA + 1] * e2
        s5 += physics[o + INERTIA + 2] * e2
        a0, a1, a2 = a0 + e0 * q, a1 + e1 * q, a2 + e2 * q
        v0, v1, v2 = v0 + e0 * speed, v1 + e1 * speed, v2 + e2 * speed
    if not turns:
        return
    rest, turn, speed = (s0, s1, s2, s3, s4, s5), (a0, a1, a2), (v0, v1, v2)
    w = (x[RATE], x[RATE + 1], x[RATE + 2])
    d = _turned(rest, turn)
    p = (s0 + d[0], s1 + d[1], s2 + d[2], s3 + d[3], s4 + d[4], s5 + d[5])
    c = _cross(turn, speed)
    g = (w[0] + v0 + 0.5 * c[0], w[1] + v1 + 0.5 * c[1], w[2] + v2 + 0.5 * c[2])
    b0, b1, b2 = _times(_turned(rest, speed), g[0], g[1], g[2])
    c = _cross(w, _times(p, g[0], g[1], g[2]))
    b0, b1, b2 = b0 + c[0], b1 + c[1], b2 + c[2]
    c = _cross(w, _times(rest, w[0], w[1], w[2]))
    r[3] -= b0 - c[0]
    r[4] -= b1 - c[1]
    r[5] -= b2 - c[2]
    K[3, 3] += d[0]
    K[3, 4] += d[1]
    K[3, 5] += d[2]
    K[4, 3] += d[1]
    K[4, 4] += d[3]
    K[4, 5] += d[4]
    K[5, 3] += d[2]
    K[5, 4] += d[4]
    K[5, 5] += d[5]
    for j in range(leader + 1, count):
        o = first + INTERNAL_SIZE * j
        if physics[o + KIND].real != TURNING or int(physics[o + LEADER].real) != leader:
            continue
        row = 6 + cables + j
        t = _along(physics, o, turn)
        n = _times(p, t[0], t[1], t[2])
        e0, e1, e2 = physics[o + AXIS], physics[o + AXIS + 1], physics[o + AXIS + 2]
        per = reciprocal(
            physics[o + INERTIA] * e0 + physics[o + INERTIA + 1] * e1 + physics[o + INERTIA + 2] * e2
        )
        K[row, 3] = n[0] * per
        K[row, 4] = n[1] * per
        K[row, 5] = n[2] * per
        K[3, row] = n[0]
        K[4, row] = n[1]
        K[5, row] = n[2]
        for k in range(leader + 1, count):
            q = first + INTERNAL_SIZE * k
            if physics[q + KIND].real == TURNING and int(physics[q + LEADER].real) == leader:
                u = _along(physics, q, turn)
                K[row, 6 + cables + k] = per * (n[0] * u[0] + n[1] * u[1] + n[2] * u[2])
        omega = 2.0 * math.pi * physics[o + FREQUENCY]
        spring = omega * omega * x[BODY_STATE + j]
        spring += 2.0 * physics[o + DAMPING_RATIO] * omega * x[BODY_STATE + count + j]
        r[row] = -per * (t[0] * b0 + t[1] * b1 + t[2] * b2) - spring
