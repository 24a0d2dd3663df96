"""A viscous moment in hinges that are bent but twist freely: a knot or a thin wire at its clamp.

As hinge_damping.py, less the part about the cable itself, which a thread hardly resists.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.hinges import add_hinge_moments
from rig_identification.model.effects.place import BENDING, CREEP, active


@njit(cache=True)
def add_hinge_bending(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of some cables' hinges that resist being bent to r."""
    damping = physics[block + BENDING]
    if active(damping):
        add_hinge_moments(
            physics, modes, cables, x, R, damping, 0.0 * damping, physics[block + CREEP], 0.0, r
        )
