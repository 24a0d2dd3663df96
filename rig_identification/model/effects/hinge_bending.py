"""A viscous moment in hinges that are bent but twist freely: a knot or a thin wire at its clamp.

As hinge_damping.py, less the part about the cable itself, which a thread hardly resists. The ends need not
be alike: a rope wound round a beam loses what a loop through an eye does not.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.hinges import add_hinge_moments
from rig_identification.model.effects.place import BENDING, CREEP, active


@njit(cache=True)
def add_hinge_bending(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of some cables' hinges that resist being bent to r."""
    upper, lower = physics[block + BENDING], physics[block + BENDING + 1]
    if active(upper) or active(lower):
        add_hinge_moments(
            physics, modes, cables, x, R, (upper, lower), 0.0 * upper, physics[block + CREEP], 0.0, r
        )
