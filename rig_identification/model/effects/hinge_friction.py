"""A Coulomb moment in the cables' hinges: of fixed size, against the relative rotation there.

Each cable may have one of its own beside what all have.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.hinges import add_hinge_moments
from rig_identification.model.effects.place import CREEP, FRICTION, HINGE_TWIST, active
from rig_identification.model.layout import CABLE_SIZE, CABLES, HINGE_FRICTION


@njit(cache=True)
def add_hinge_friction(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of some cables' rubbing hinges to r."""
    torque, creep = physics[block + FRICTION], physics[block + CREEP]
    none, twist = 0.0 * torque, physics[block + HINGE_TWIST]
    if active(torque):
        add_hinge_moments(physics, modes, cables, x, R, (none, none), torque, creep, twist, r)
    for i in range(cables[0], cables[1]):
        own = physics[CABLES + CABLE_SIZE * i + HINGE_FRICTION]
        if active(own):
            add_hinge_moments(physics, modes, (i, i + 1), x, R, (none, none), own, creep, twist, r)
