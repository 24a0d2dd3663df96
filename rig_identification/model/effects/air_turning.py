"""Air against a body that turns: a moment against the square of its rate, 1/2 rho C |w| w.

A plate of area A that stands across its way at distance r from the axis gives C = Cd A r^3.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import root
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.effects.place import TURNING_DRAG, active
from rig_identification.model.layout import RATE


@njit(cache=True)
def add_air_turning(physics, block, x, r):  # type: ignore[no-untyped-def]
    """Add the moment of the air to r."""
    size = physics[block + TURNING_DRAG]
    if not active(size):
        return
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    # 1e-12 rad^2/s^2 keeps the root's derivative finite at rest
    factor = -0.5 * AIR * size * root(wx * wx + wy * wy + wz * wz + 1e-12)
    r[3] += factor * wx
    r[4] += factor * wy
    r[5] += factor * wz
