"""A share of the body's gyroscopic moment left out, as in the thesis' equations (3.4) to (3.9).

About the centre of mass Euler's equation is J alpha + w x (J w) = M. A model without the second term, in a
share s of it, obeys J alpha + (1 - s) w x (J w) = M: it puts a couple s w x (J w) on the body that is not
there. A couple is the same about every point, so it enters the rows of moment about the datum as it stands,
and the force's rows not at all. The model holds the inertia about the datum, I = J + m (|c|^2 1 - c c^T) with
h = m c, so that
    J w = I w - h x (w x h)/m          (c x (w x c) = (|c|^2 1 - c c^T) w)
What the datum's distance from the centre of mass adds, h x (w x (w x h))/m, is centripetal, no
gyroscopic moment, and stays. The share is 0 in nature.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal
from rig_identification.model.effects.place import GYROSCOPIC_SHARE, active
from rig_identification.model.layout import INERTIAL, RATE


@njit(cache=True)
def add_gyroscopic_share(physics, block, x, r):  # type: ignore[no-untyped-def]
    """Add the couple s w x (J w), N m along body axes, to r."""
    share = physics[block + GYROSCOPIC_SHARE]
    if not active(share):
        return
    hx, hy, hz = physics[INERTIAL + 1], physics[INERTIAL + 2], physics[INERTIAL + 3]
    ixx, ixy, ixz = physics[INERTIAL + 4], physics[INERTIAL + 5], physics[INERTIAL + 6]
    iyy, iyz, izz = physics[INERTIAL + 7], physics[INERTIAL + 8], physics[INERTIAL + 9]
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    per_mass = reciprocal(physics[INERTIAL])
    ax, ay, az = wy * hz - wz * hy, wz * hx - wx * hz, wx * hy - wy * hx
    lx = ixx * wx + ixy * wy + ixz * wz - (hy * az - hz * ay) * per_mass
    ly = ixy * wx + iyy * wy + iyz * wz - (hz * ax - hx * az) * per_mass
    lz = ixz * wx + iyz * wy + izz * wz - (hx * ay - hy * ax) * per_mass
    r[3] += share * (wy * lz - wz * ly)
    r[4] += share * (wz * lx - wx * lz)
    r[5] += share * (wx * ly - wy * lx)
