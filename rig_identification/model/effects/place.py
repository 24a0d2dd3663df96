"""Where each effect's numbers stand in the effects' block of ``physics`` (layout.py).

All zero means: not there. The reference pose is a constant of the session, not a parameter.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.layout import CABLE_SIZE, CABLES, INTERNAL_SIZE

# Amounts first: where all of them are zero, no effect acts
DAMPING = 0  # N m s/rad
FRICTION = 1  # N m
DRAG_AREA = 2  # m^2
ADDED_MASS = 3  # kg
ROTOR_MASS = 4  # kg
LINEAR_DENSITY = 5  # kg/m
GYROSCOPIC_SHARE = 6  # 1: share of the gyroscopic moment that the model lacks
BENDING = 7  # N m s/rad
ROLL_STIFFNESS = 8  # N m/rad
TURNING_CUBE = 9  # N m
PLATES = 10  # 2: m^2, facing the body's x and y axis
TETHER_STIFFNESS = 12  # 3: N/m, world axes
TETHER_PULL = 15  # 3: N, world axes
LAW_SPRING = 18  # 3: N/m, N/m^2, N/m^3
LAW_BRAKE = 21  # 2: N s/m, N s^2/m^2
TORSION = 23  # N m/rad, each cable
TWISTED = 24  # 3: N m, world axes: moment with which cables are twisted at rest
TETHER_POINT = 27  # 3: m, body
REFERENCE_POSITION = 30  # 3: m, world
REFERENCE_ROTATION = 33  # 9: rotation matrix, row by row
ROLL_AXIS = 42  # 3: unit vector in body, a constant of the session like the reference pose
ROLL_SKEW = 45  # tangent of the angle about the vertical between ROLL_AXIS and the axis that hinges hold
PLATE_REACH = 46  # m, a constant of the session
SHARING = 47  # m/s^2 per N: how softly redundant rigid cables share the load (dynamics.py)
CREEP = 48  # rad/s: rate of a hinge below which its friction grows with the rate instead of jumping
TETHER_REACH = 49  # 3: m, world: from the body's point at rest to the wall; all 0: a spring on each axis
LAW_POINT = 52  # 3: m, body
LAW_DIRECTION = 55  # 2: rad, azimuth and elevation of the spring's line in the world
LAW_NARROW = 57  # 1/m^2: how fast the brake fades away from where its point hangs at rest
EFFECTS_SIZE = 58


def effects_block(cables: int) -> int:
    """First entry of the effects' block."""
    return CABLES + CABLE_SIZE * cables


def internal_block(cables: int, number: int) -> int:
    """First entry of internal coordinate ``number``'s block."""
    return effects_block(cables) + EFFECTS_SIZE + INTERNAL_SIZE * number


@njit(cache=True, inline="always")
def active(value):  # type: ignore[no-untyped-def]
    """Whether a parameter, or its derivative, is asked for."""
    return value.real != 0.0 or value.imag != 0.0
