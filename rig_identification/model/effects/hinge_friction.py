"""A Coulomb moment in the cables' hinges: of fixed size, against the relative rotation there."""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.hinges import add_hinge_moments
from rig_identification.model.effects.place import CREEP, FRICTION, active


@njit(cache=True)
def add_hinge_friction(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of some cables' rubbing hinges to r."""
    torque = physics[block + FRICTION]
    if active(torque):
        none = 0.0 * torque
        add_hinge_moments(physics, modes, cables, x, R, (none, none), torque, physics[block + CREEP], 1.0, r)
