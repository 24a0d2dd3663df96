"""Inertia of a point that moves with the body, in the rows of dynamics.py."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def add_point_inertia(mass, cx, cy, cz, wx, wy, wz, K, r):  # type: ignore[no-untyped-def]
    """Add m (A + alpha x c + w x (w x c)) and its moment about the datum; no weight."""
    hx, hy, hz = mass * cx, mass * cy, mass * cz
    K[0, 0] += mass
    K[1, 1] += mass
    K[2, 2] += mass
    K[0, 4] += hz
    K[0, 5] -= hy
    K[1, 3] -= hz
    K[1, 5] += hx
    K[2, 3] += hy
    K[2, 4] -= hx
    K[4, 0] += hz
    K[5, 0] -= hy
    K[3, 1] -= hz
    K[5, 1] += hx
    K[3, 2] += hy
    K[4, 2] -= hx
    K[3, 3] += hy * cy + hz * cz
    K[4, 4] += hx * cx + hz * cz
    K[5, 5] += hx * cx + hy * cy
    K[3, 4] -= hx * cy
    K[4, 3] -= hx * cy
    K[3, 5] -= hx * cz
    K[5, 3] -= hx * cz
    K[4, 5] -= hy * cz
    K[5, 4] -= hy * cz
    ax, ay, az = wy * hz - wz * hy, wz * hx - wx * hz, wx * hy - wy * hx
    fx, fy, fz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
    r[0] -= fx
    r[1] -= fy
    r[2] -= fz
    r[3] -= cy * fz - cz * fy
    r[4] -= cz * fx - cx * fz
    r[5] -= cx * fy - cy * fx
