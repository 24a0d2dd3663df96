"""Something that spins at a constant rate on the body, a motor's rotor or a flywheel.

With its angular momentum H, constant in body axes, beside that of the body, Euler's equation about the body's
datum gains the couple -w x H: what spins resists being turned about any axis but its own, at right angles to
the turn. A couple is the same about every point. Its mass is part of the body's, and so is its inertia.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.place import SPIN
from rig_identification.model.layout import RATE


@njit(cache=True)
def add_spinning_part(physics, block, x, r):  # type: ignore[no-untyped-def]
    """Add the couple -w x H, N m along body axes, to r."""
    hx, hy, hz = physics[block + SPIN], physics[block + SPIN + 1], physics[block + SPIN + 2]
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    r[3] -= wy * hz - wz * hy
    r[4] -= wz * hx - wx * hz
    r[5] -= wx * hy - wy * hx
