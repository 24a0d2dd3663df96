"""A viscous moment in the cables' hinges.

A cable along e (ceiling to body) turns at O = e x s / l, s being the velocity of its lower hinge,
and spins about itself at half the body's twist e.w: being massless it passes the same moment
about itself through both hinges. With that spin in O, the body's hinge puts -c (w - O) on the
body and the reverse on the cable, the ceiling's puts -c O on the cable. A massless cable
under a net moment M is held by forces across it, which put F = -e x M / l on the body. Each cable may have
a damping of its own beside what all have.

A hinge on a swivel is bent and not twisted: of the turning about the cable only a share counts, 1 in a ball
joint, 0 in a shackle that swivels. Nothing but the motion tells which, so it is estimated.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.hinges import add_hinge_moments
from rig_identification.model.effects.place import CREEP, DAMPING, HINGE_TWIST, active
from rig_identification.model.layout import CABLE_SIZE, CABLES, HINGE_DAMPING


@njit(cache=True)
def add_hinge_damping(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of some cables' viscous hinges to r."""
    damping, creep = physics[block + DAMPING], physics[block + CREEP]
    none, twist = 0.0 * damping, physics[block + HINGE_TWIST]
    if active(damping):
        add_hinge_moments(physics, modes, cables, x, R, (damping, damping), none, creep, twist, r)
    for i in range(cables[0], cables[1]):
        own = physics[CABLES + CABLE_SIZE * i + HINGE_DAMPING]
        if active(own):
            add_hinge_moments(physics, modes, (i, i + 1), x, R, (own, own), none, creep, twist, r)
