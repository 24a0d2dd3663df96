"""A point of the body: how far it is from where it hangs at rest, and a force there."""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.place import REFERENCE_POSITION, REFERENCE_ROTATION
from rig_identification.model.layout import RATE, VELOCITY


@njit(cache=True, inline="always")
def travel(physics, block, point, x, R):  # type: ignore[no-untyped-def]
    """(3,) m, world: how far the point that stands at entry ``point`` of the block is from there."""
    return (
        _along(physics, block, point, x, R, 0),
        _along(physics, block, point, x, R, 1),
        _along(physics, block, point, x, R, 2),
    )


@njit(cache=True, inline="always")
def _along(physics, block, point, x, R, i):  # type: ignore[no-untyped-def]
    a, t = block + point, block + REFERENCE_ROTATION + 3 * i
    moved = x[i] - physics[block + REFERENCE_POSITION + i]
    for j in range(3):
        moved += (R[i, j] - physics[t + j]) * physics[a + j]
    return moved


@njit(cache=True, inline="always")
def velocity_of(physics, entry, x, R):  # type: ignore[no-untyped-def]
    """(3,) m/s, world, of the point (m, body) at ``entry`` of the physics."""
    ax, ay, az = physics[entry], physics[entry + 1], physics[entry + 2]
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    sx, sy, sz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
    return (
        x[VELOCITY] + R[0, 0] * sx + R[0, 1] * sy + R[0, 2] * sz,
        x[VELOCITY + 1] + R[1, 0] * sx + R[1, 1] * sy + R[1, 2] * sz,
        x[VELOCITY + 2] + R[2, 0] * sx + R[2, 1] * sy + R[2, 2] * sz,
    )


@njit(cache=True, inline="always")
def push_at(physics, entry, R, wx, wy, wz, r):  # type: ignore[no-untyped-def]
    """Add a force (N, world) at the point (m, body) at ``entry`` of the physics to r."""
    ax, ay, az = physics[entry], physics[entry + 1], physics[entry + 2]
    fx = R[0, 0] * wx + R[1, 0] * wy + R[2, 0] * wz
    fy = R[0, 1] * wx + R[1, 1] * wy + R[2, 1] * wz
    fz = R[0, 2] * wx + R[1, 2] * wy + R[2, 2] * wz
    force_at(ax, ay, az, fx, fy, fz, r)


@njit(cache=True, inline="always")
def force_at(ax, ay, az, fx, fy, fz, r):  # type: ignore[no-untyped-def]
    """Add a force (N, body) at the point a (m, body) to r."""
    r[0] += fx
    r[1] += fy
    r[2] += fz
    r[3] += ay * fz - az * fy
    r[4] += az * fx - ax * fz
    r[5] += ax * fy - ay * fx
