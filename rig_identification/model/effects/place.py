"""Where each effect's numbers stand in the effects' block of ``physics`` (layout.py).

All zero means: not there. The reference pose is a constant of the session, not a parameter.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.layout import CABLE_SIZE, CABLES, INTERNAL_SIZE
from rig_identification.own import MOST_EFFECTS, MOST_NUMBERS

# Amounts first: where all of them are zero, no effect acts
DAMPING = 0  # N m s/rad
FRICTION = 1  # N m
DRAG_AREA = 2  # m^2
ADDED_MASS = 3  # kg
ROTOR_MASS = 4  # kg
LINEAR_DENSITY = 5  # kg/m
GYROSCOPIC_SHARE = 6  # 1: share of the gyroscopic moment that the model lacks
BENDING = 7  # 2: N m s/rad, in the hinges at the ceiling and at the body
ROLL_STIFFNESS = 9  # N m/rad
TURNING_CUBE = 10  # N m
PLATES = 11  # 2: m^2, facing the body's x and y axis
TETHER_STIFFNESS = 13  # 3: N/m, world axes
TETHER_PULL = 16  # 3: N, world axes
LAW_SPRING = 19  # 3: N/m, N/m^2, N/m^3
LAW_BRAKE = 22  # 2: N s/m, N s^2/m^2
TORSION = 24  # N m/rad, each cable
TWISTED = 25  # 3: N m, world axes: moment with which cables are twisted at rest
LEANING = 28  # 1 where upper ends hold their cables (layout.LEAN): a constant, asked for in their stead
SPIN = 29  # 3: N m s, body axes: angular momentum of what spins on the body
AIR_PLATE = 32  # m^2
AIR_CARRIED = 33  # 3: kg, body axes: air that a side carries along
TETHER_POINT = 36  # 3: m, body
REFERENCE_POSITION = 39  # 3: m, world
REFERENCE_ROTATION = 42  # 9: rotation matrix, row by row
ROLL_AXIS = 51  # 3: unit vector in body, a constant of the session like the reference pose
ROLL_SKEW = 54  # tangent of the angle about the vertical between ROLL_AXIS and the axis that hinges hold
PLATE_REACH = 55  # m, a constant of the session
SHARING = 56  # m/s^2 per N: how softly redundant rigid cables share the load (dynamics.py)
CREEP = 57  # rad/s: rate of a hinge below which its friction grows with the rate instead of jumping
TETHER_REACH = 58  # 3: m, world: from the body's point at rest to the wall; all 0: a spring on each axis
LAW_POINT = 61  # 3: m, body
LAW_DIRECTION = 64  # 2: rad, azimuth and elevation of the law's line in the world
LAW_NARROW = 66  # 1/m^2: how fast the brake fades away from where its point hangs at rest
TETHER_DAMPING = 67  # N s/m, along a taut tether
TETHER_PRELOAD = 68  # N: pull of a taut tether at rest, beside what TETHER_PULL has along it
AIR_PLATE_NORMAL = 69  # 2: rad, azimuth and elevation of its normal in the body
AIR_PLATE_POINT = 71  # 3: m, body
AIR_PLATE_ALONG = 74  # 1: how far air that passes along the plate counts as well
LAW_SATURATION = 75  # s^2/m^2: how fast the brake's force falls behind as its point goes faster
LAW_UPRIGHT = 76  # 1: how far the brake resists what its point does along the vertical
AIR_CARRIED_POINT = 77  # 3: m, body
HINGE_TWIST = 80  # 1: share of a hinge's moment against being bent that it has against being twisted
LAW_ACROSS = 81  # 1: how far the brake resists what its point does across the law's line
OWN = 82  # MOST_EFFECTS times OWN_SIZE: effects of the lab's own (own.py): two addresses, then its numbers
OWN_NUMBERS = 2  # within such an effect's entries
OWN_SIZE = OWN_NUMBERS + MOST_NUMBERS
EFFECTS_SIZE = OWN + MOST_EFFECTS * OWN_SIZE


def effects_block(cables: int) -> int:
    """First entry of the effects' block."""
    return CABLES + CABLE_SIZE * cables


@njit(cache=True, inline="always")
def own_block(block, number):  # type: ignore[no-untyped-def]
    """First entry of the lab's own effect ``number``; block: first entry of the effects' block."""
    return block + OWN + OWN_SIZE * number


def internal_block(cables: int, number: int) -> int:
    """First entry of internal coordinate ``number``'s block."""
    return effects_block(cables) + EFFECTS_SIZE + INTERNAL_SIZE * number


@njit(cache=True, inline="always")
def active(value):  # type: ignore[no-untyped-def]
    """Whether a parameter, or its derivative, is asked for."""
    return value.real != 0.0 or value.imag != 0.0
