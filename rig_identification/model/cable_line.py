"""A cable as the body sees it, and what moving one of its hinges does, for derivatives that are written out.

u: unit vector from the body's hinge b to the ceiling's, D: the line between them, of length l, s: the body
hinge's velocity against the ceiling's, all in body axes. Where the line changes by dD and the velocity by ds,
    dl = u . dD,   du = (dD - u dl)/l,   d(u . s) = du . s + u . ds
and dl/dt is -(u . s).
"""

from __future__ import annotations

import math

from numba import njit

from rig_identification.model.effects.internal import ceiling_shift
from rig_identification.model.layout import BODY_POINT, CABLE_SIZE, CABLES, CEILING_POINT, RATE, VELOCITY


@njit(cache=True, inline="always")
def cross(ax, ay, az, bx, by, bz):  # type: ignore[no-untyped-def]
    """a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(cache=True, inline="always")
def in_body(R, a, b, c):  # type: ignore[no-untyped-def]
    """R^T (a, b, c): a world vector in body axes."""
    return (
        R[0, 0] * a + R[1, 0] * b + R[2, 0] * c,
        R[0, 1] * a + R[1, 1] * b + R[2, 1] * c,
        R[0, 2] * a + R[1, 2] * b + R[2, 2] * c,
    )


@njit(cache=True)
def cable_line(physics, cables, i, x, R):  # type: ignore[no-untyped-def]
    """Of cable i: u, the line from the datum to the ceiling's hinge, R^T v, w x b, s (3 each), and l."""
    o = CABLES + CABLE_SIZE * i
    # A yielding ceiling moves the upper hinges
    s0, s1, s2, c0, c1, c2 = ceiling_shift(physics, cables, x, i)
    vx, vy, vz = in_body(R, x[VELOCITY] - c0, x[VELOCITY + 1] - c1, x[VELOCITY + 2] - c2)
    bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
    d0 = physics[o + CEILING_POINT] + s0 - x[0]
    d1 = physics[o + CEILING_POINT + 1] + s1 - x[1]
    d2 = physics[o + CEILING_POINT + 2] + s2 - x[2]
    fx, fy, fz = in_body(R, d0, d1, d2)
    ux, uy, uz = fx - bx, fy - by, fz - bz
    length = math.sqrt(ux * ux + uy * uy + uz * uz)
    per_length = 1.0 / length
    u = ux * per_length, uy * per_length, uz * per_length
    ex, ey, ez = cross(x[RATE], x[RATE + 1], x[RATE + 2], bx, by, bz)
    return u, (fx, fy, fz), (vx, vy, vz), (ex, ey, ez), (vx + ex, vy + ey, vz + ez), length


@njit(cache=True)
def line_change(u, s, length, dD, ds):  # type: ignore[no-untyped-def]
    """dl, du (3) and d(u . s) of changes dD of the line and ds of the velocity (3 each)."""
    longer = u[0] * dD[0] + u[1] * dD[1] + u[2] * dD[2]
    per_length = 1.0 / length
    tx = (dD[0] - u[0] * longer) * per_length
    ty = (dD[1] - u[1] * longer) * per_length
    tz = (dD[2] - u[2] * longer) * per_length
    faster = tx * s[0] + ty * s[1] + tz * s[2] + u[0] * ds[0] + u[1] * ds[1] + u[2] * ds[2]
    return longer, (tx, ty, tz), faster


@njit(cache=True)
def hinge_change(x, R, number):  # type: ignore[no-untyped-def]
    """db, dD, ds (3 each) of a unit of a cable's first six numbers: the ceiling's point and the body's."""
    k = number % 3
    if number < BODY_POINT:
        return (0.0, 0.0, 0.0), (R[k, 0], R[k, 1], R[k, 2]), (0.0, 0.0, 0.0)
    hx, hy, hz = 1.0 * (k == 0), 1.0 * (k == 1), 1.0 * (k == 2)
    return (hx, hy, hz), (-hx, -hy, -hz), cross(x[RATE], x[RATE + 1], x[RATE + 2], hx, hy, hz)
