"""What moments in the cables' hinges do to the body (derived in hinge_damping.py)."""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.direction import cable_direction
from rig_identification.model.layout import (
    BODY_POINT,
    CABLE_SIZE,
    CABLES,
    RATE,
    SLACK,
    VELOCITY,
)


@njit(cache=True)
def _law(viscous, rubbing, creep, a, b, c):  # type: ignore[no-untyped-def]
    """Moment per unit of relative rate (a, b, c)."""
    return viscous + rubbing * reciprocal(root(a * a + b * b + c * c + creep * creep))


@njit(cache=True)
def add_hinge_moments(physics, modes, cables, x, R, viscous, rubbing, creep, twist, r):  # type: ignore[no-untyped-def]
    """Add to r (6 rows) the wrench of moments -(viscous + rubbing/|rate|) rate in the hinges of some cables.

    cables: first and last but one of them, as in range(). viscous (2,): at the ceiling and at the body.
    creep (rad/s): rate below which rubbing grows with the rate instead of jumping, as dry bearings do.
    twist: 1 where a hinge resists being twisted as it resists being bent, 0 where it twists freely.
    """
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    v0, v1, v2 = x[VELOCITY], x[VELOCITY + 1], x[VELOCITY + 2]
    vx = R[0, 0] * v0 + R[1, 0] * v1 + R[2, 0] * v2
    vy = R[0, 1] * v0 + R[1, 1] * v1 + R[2, 1] * v2
    vz = R[0, 2] * v0 + R[1, 2] * v1 + R[2, 2] * v2
    for i in range(cables[0], cables[1]):
        if modes[i] == SLACK:
            continue
        o = CABLES + CABLE_SIZE * i
        bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
        ex, ey, ez, per_length = cable_direction(physics, o, x[0], x[1], x[2], R)
        sx = (vx + wy * bz - wz * by) * per_length
        sy = (vy + wz * bx - wx * bz) * per_length
        sz = (vz + wx * by - wy * bx) * per_length
        ox, oy, oz = ey * sz - ez * sy, ez * sx - ex * sz, ex * sy - ey * sx
        ax, ay, az = wx - ox, wy - oy, wz - oz
        # A massless cable cannot hold a moment about itself: it spins at half the body's twist, so that
        # its two hinges, alike, pass on the same moment
        spin = ex * ax + ey * ay + ez * az
        half = 0.5 * twist * spin
        off = spin - half
        ax, ay, az = ax - off * ex, ay - off * ey, az - off * ez
        ox, oy, oz = ox + half * ex, oy + half * ey, oz + half * ez
        lower = _law(viscous[1], rubbing, creep, ax, ay, az)
        upper = _law(viscous[0], rubbing, creep, ox, oy, oz)
        # Net moment on the cable, then the force across it at the body's hinge
        mx, my, mz = lower * ax - upper * ox, lower * ay - upper * oy, lower * az - upper * oz
        fx = -(ey * mz - ez * my) * per_length
        fy = -(ez * mx - ex * mz) * per_length
        fz = -(ex * my - ey * mx) * per_length
        r[0] += fx
        r[1] += fy
        r[2] += fz
        r[3] += by * fz - bz * fy - lower * ax
        r[4] += bz * fx - bx * fz - lower * ay
        r[5] += bx * fy - by * fx - lower * az
