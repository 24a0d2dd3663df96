"""The body's centre of mass and its velocity, body axes, as the air needs them."""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal
from rig_identification.model.layout import INERTIAL, RATE, VELOCITY


@njit(cache=True)
def center_of_mass(physics):  # type: ignore[no-untyped-def]
    """Where it is, m."""
    per_mass = reciprocal(physics[INERTIAL])
    return (
        physics[INERTIAL + 1] * per_mass,
        physics[INERTIAL + 2] * per_mass,
        physics[INERTIAL + 3] * per_mass,
    )


@njit(cache=True)
def velocity_of(x, R, cx, cy, cz):  # type: ignore[no-untyped-def]
    """Velocity (m/s) of the body's point (cx, cy, cz)."""
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    v0, v1, v2 = x[VELOCITY], x[VELOCITY + 1], x[VELOCITY + 2]
    return (
        R[0, 0] * v0 + R[1, 0] * v1 + R[2, 0] * v2 + wy * cz - wz * cy,
        R[0, 1] * v0 + R[1, 1] * v1 + R[2, 1] * v2 + wz * cx - wx * cz,
        R[0, 2] * v0 + R[1, 2] * v1 + R[2, 2] * v2 + wx * cy - wy * cx,
    )
