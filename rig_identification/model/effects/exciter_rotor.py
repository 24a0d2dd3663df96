"""The exciter's moving mass: it rides on the body at the exciter's origin, unfelt by its force cells."""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.place import ROTOR_MASS, active
from rig_identification.model.effects.point import force_at
from rig_identification.model.effects.point_mass import add_point_inertia
from rig_identification.model.layout import EXCITER_POSITION, GRAVITY, RATE


@njit(cache=True)
def add_exciter_rotor(physics, block, x, R, K, r):  # type: ignore[no-untyped-def]
    """Add inertia and weight of the rotor to K and r."""
    mass = physics[block + ROTOR_MASS]
    if not active(mass):
        return
    px, py, pz = physics[EXCITER_POSITION], physics[EXCITER_POSITION + 1], physics[EXCITER_POSITION + 2]
    add_point_inertia(mass, px, py, pz, x[RATE], x[RATE + 1], x[RATE + 2], K, r)
    g0, g1, g2 = physics[GRAVITY], physics[GRAVITY + 1], physics[GRAVITY + 2]
    fx = mass * (R[0, 0] * g0 + R[1, 0] * g1 + R[2, 0] * g2)
    fy = mass * (R[0, 1] * g0 + R[1, 1] * g1 + R[2, 1] * g2)
    fz = mass * (R[0, 2] * g0 + R[1, 2] * g1 + R[2, 2] * g2)
    force_at(px, py, pz, fx, fy, fz, r)
