"""A hose or wire pulls: a spring between a point of the body and the room.

F = F0 - k (q - q0) in world axes, axis by axis, q being the point on the body and q0 where it hangs
at rest (a constant of the session); F0 is the pull at rest.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.place import (
    REFERENCE_POSITION,
    REFERENCE_ROTATION,
    TETHER_POINT,
    TETHER_PULL,
    TETHER_STIFFNESS,
    active,
)


@njit(cache=True)
def add_tether(physics, block, x, R, r):  # type: ignore[no-untyped-def]
    """Add the tether's pull to r."""
    on = False
    for i in range(3):
        on = on or active(physics[block + TETHER_STIFFNESS + i]) or active(physics[block + TETHER_PULL + i])
    if not on:
        return
    a = block + TETHER_POINT
    ax, ay, az = physics[a], physics[a + 1], physics[a + 2]
    fx, fy, fz = 0.0 * ax, 0.0 * ax, 0.0 * ax
    for i in range(3):
        t = block + REFERENCE_ROTATION + 3 * i
        here = x[i] + R[i, 0] * ax + R[i, 1] * ay + R[i, 2] * az
        rest = (
            physics[block + REFERENCE_POSITION + i]
            + physics[t] * ax
            + physics[t + 1] * ay
            + physics[t + 2] * az
        )
        f = physics[block + TETHER_PULL + i] - physics[block + TETHER_STIFFNESS + i] * (here - rest)
        fx += R[i, 0] * f
        fy += R[i, 1] * f
        fz += R[i, 2] * f
    r[0] += fx
    r[1] += fy
    r[2] += fz
    r[3] += ay * fz - az * fy
    r[4] += az * fx - ax * fz
    r[5] += ax * fy - ay * fx
