"""Hinges that hold the body against rolling about one axis: a bridle, a loop round a bar, a stiff knot.

With e_i the direction of cable i in the body (ceiling to body), f_i the one at rest and a the axis, the n
hinges store 1/2 k s^2, s = sum a . (f_i x e_i)/n being the mean turn of the body against its cables. That
puts the moments k s/n e_i x (a x f_i) on the body and the reverse on the cables, which being massless are
held by forces across them (hinge_damping.py). It is the mean that counts: where the body turns about the
vertical the cables lean to opposite sides, and what hinges do against that acts like the cables' own
pull, which no motion tells from the inertia about the vertical. A bridle whose legs meet a height h
above the hinges acts like k = W h, W being the body's weight. Legs that do not lie square to the line
of hinges hold about another axis: a is the given one turned about the vertical at rest by an angle of
tangent ROLL_SKEW, and sway along the cables' plane then goes with sway across it.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.direction import cable_direction
from rig_identification.model.effects.place import (
    REFERENCE_POSITION,
    REFERENCE_ROTATION,
    ROLL_AXIS,
    ROLL_SKEW,
    ROLL_STIFFNESS,
    active,
)
from rig_identification.model.layout import BODY_POINT, CABLE_SIZE, CABLES, SLACK


@njit(cache=True)
def _axis(physics, block, rest):  # type: ignore[no-untyped-def]
    """Unit vector about which the hinges hold, body axes. rest: (3, 3) R_world_body at rest."""
    ax, ay, az = physics[block + ROLL_AXIS], physics[block + ROLL_AXIS + 1], physics[block + ROLL_AXIS + 2]
    skew = physics[block + ROLL_SKEW]
    if not active(skew):
        return ax, ay, az
    ux, uy, uz = rest[2, 0], rest[2, 1], rest[2, 2]
    ax, ay, az = (
        ax + skew * (uy * az - uz * ay),
        ay + skew * (uz * ax - ux * az),
        az + skew * (ux * ay - uy * ax),
    )
    scale = reciprocal(root(ax * ax + ay * ay + az * az))
    return ax * scale, ay * scale, az * scale


@njit(cache=True)
def add_hinge_roll(physics, block, modes, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of hinges that hold against rolling to r."""
    stiffness = physics[block + ROLL_STIFFNESS]
    if not active(stiffness):
        return
    rest = physics[block + REFERENCE_ROTATION : block + REFERENCE_ROTATION + 9].reshape(3, 3)
    ax, ay, az = _axis(physics, block, rest)
    p = block + REFERENCE_POSITION
    turned, taut = 0.0 * stiffness, 0.0
    for i in range(modes.shape[0]):
        if modes[i] == SLACK:
            continue
        o = CABLES + CABLE_SIZE * i
        fx, fy, fz, _ = cable_direction(physics, o, physics[p], physics[p + 1], physics[p + 2], rest)
        ex, ey, ez, _ = cable_direction(physics, o, x[0], x[1], x[2], R)
        turned += ax * (fy * ez - fz * ey) + ay * (fz * ex - fx * ez) + az * (fx * ey - fy * ex)
        taut += 1.0
    if taut == 0.0:
        return
    moment = stiffness * turned * (1.0 / (taut * taut))
    for i in range(modes.shape[0]):
        if modes[i] == SLACK:
            continue
        o = CABLES + CABLE_SIZE * i
        fx, fy, fz, _ = cable_direction(physics, o, physics[p], physics[p + 1], physics[p + 2], rest)
        ex, ey, ez, per_length = cable_direction(physics, o, x[0], x[1], x[2], R)
        # e x (a x e0) = a (e . e0) - e0 (e . a)
        along, aside = ex * fx + ey * fy + ez * fz, ex * ax + ey * ay + ez * az
        mx, my, mz = (
            moment * (ax * along - fx * aside),
            moment * (ay * along - fy * aside),
            moment * (az * along - fz * aside),
        )
        gx, gy, gz = (
            (ey * mz - ez * my) * per_length,
            (ez * mx - ex * mz) * per_length,
            (ex * my - ey * mx) * per_length,
        )
        bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
        r[0] += gx
        r[1] += gy
        r[2] += gz
        r[3] += mx + by * gz - bz * gy
        r[4] += my + bz * gx - bx * gz
        r[5] += mz + bx * gy - by * gx
