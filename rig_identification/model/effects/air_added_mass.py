"""Entrained air: it moves with the body's centre of mass and weighs nothing (its weight is borne by air)."""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.center import center_of_mass
from rig_identification.model.effects.place import ADDED_MASS, active
from rig_identification.model.effects.point_mass import add_point_inertia
from rig_identification.model.layout import RATE


@njit(cache=True)
def add_air_added_mass(physics, block, x, K, r):  # type: ignore[no-untyped-def]
    """Add the inertia of entrained air to K and r."""
    mass = physics[block + ADDED_MASS]
    if not active(mass):
        return
    cx, cy, cz = center_of_mass(physics)
    add_point_inertia(mass, cx, cy, cz, x[RATE], x[RATE + 1], x[RATE + 2], K, r)
