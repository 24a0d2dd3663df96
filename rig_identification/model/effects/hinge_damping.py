"""A viscous moment in the cables' hinges.

A cable along e (ceiling to body) turns at O = e x s / l, s being the velocity of its lower hinge,
and spins about itself at half the body's twist e.w: being massless it passes the same moment
about itself through both hinges. With that spin in O, the body's hinge puts -c (w - O) on the
body and the reverse on the cable, the ceiling's puts -c O on the cable. A massless cable
under a net moment M is held by forces across it, which put F = -e x M / l on the body.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.hinges import add_hinge_moments
from rig_identification.model.effects.place import CREEP, DAMPING, active


@njit(cache=True)
def add_hinge_damping(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the force and moment of some cables' viscous hinges to r."""
    damping = physics[block + DAMPING]
    if active(damping):
        add_hinge_moments(
            physics, modes, cables, x, R, (damping, damping), 0.0 * damping, physics[block + CREEP], 1.0, r
        )
