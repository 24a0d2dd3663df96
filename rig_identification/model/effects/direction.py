"""Where a cable runs, as the body sees it."""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.layout import BODY_POINT, CEILING_POINT


@njit(cache=True)
def cable_direction(physics, o, p0, p1, p2, R):  # type: ignore[no-untyped-def]
    """Unit vector from a cable's ceiling to its body hinge, body axes, and the reciprocal of their distance.

    o: the cable's first entry of ``physics``. p0, p1, p2: the datum, m, world. R: (3, 3) R_world_body.
    """
    d0 = p0 - physics[o + CEILING_POINT]
    d1 = p1 - physics[o + CEILING_POINT + 1]
    d2 = p2 - physics[o + CEILING_POINT + 2]
    ex = R[0, 0] * d0 + R[1, 0] * d1 + R[2, 0] * d2 + physics[o + BODY_POINT]
    ey = R[0, 1] * d0 + R[1, 1] * d1 + R[2, 1] * d2 + physics[o + BODY_POINT + 1]
    ez = R[0, 2] * d0 + R[1, 2] * d1 + R[2, 2] * d2 + physics[o + BODY_POINT + 2]
    per_length = reciprocal(root(ex * ex + ey * ey + ez * ez))
    return ex * per_length, ey * per_length, ez * per_length, per_length
