"""Where each physical quantity stands in the forward model's flat arrays.

One array ``physics`` holds every number that the motion depends on; the blocks are
gravity, the ten inertial parameters, the exciter, one block a cable, one block an effect.
The inertial block is the one in which the Newton-Euler equations are linear: mass, first
moment m c, and the inertia about the body datum (not about the centre of mass).
"""

from __future__ import annotations

GRAVITY = 0  # 3: acceleration of gravity in world, m/s^2
INERTIAL = 3  # 10: m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the datum
EXCITER_POSITION = 13  # 3: m, body
EXCITER_ROTATION = 16  # 3: rotation vector of exciter frame against its description, rad, body axes
EXCITER_GAIN = 19  # 1: factor from measured to true force
CABLES = 20  # first cable block
CABLE_SIZE = 15
CEILING_POINT = 0  # 3: m, world
BODY_POINT = 3  # 3: m, body
LENGTH = 6  # m
AXIAL_STIFFNESS = 7  # EA, N
AXIAL_DAMPING = 8  # time constant tau of Kelvin-Voigt damping, s
CELL_AT_CEILING = 9  # 1: the load cell sits at the ceiling end; 0: at the body
LEAN = 10  # 3: N m/rad, xx, xy, yy: how its upper end holds the cable as it leans (effects/held_ends.py)
HINGE_DAMPING = 13  # N m s/rad, of its own two hinges beside what all have (effects/hinge_damping.py)
HINGE_FRICTION = 14  # N m, of its own two hinges beside what all have (effects/hinge_friction.py)

# One internal coordinate (effects/internal.py); its block follows the effects' block
KIND = 0  # constant: RIDER, CEILING or TURNING
LEADER = 1  # constant: number of the coordinate that holds what those of one mass share
AXIS = 2  # 3: direction, in body (rider) or world (ceiling)
MASS = 5  # kg (rider)
POINT = 6  # 3: m, body: where a rider rests
INERTIA = 6  # 3: kg m^2 (turning), of a rider about its centre, x, y, z against AXIS (effects/turning.py)
HINGE = 6  # constant (ceiling): 0 moves all upper hinges, i + 1 that of cable i alone
FREQUENCY = 9  # Hz
DAMPING_RATIO = 10
COMPLIANCE = 11  # m/N (ceiling)
STOP = 12  # m: a rider slides and meets its stops this far from its place; 0: it has none
PENDULUM = 13  # constant: 1 where a rider of two coordinates hangs instead of riding on springs
STOP_DAMPING = 14  # damping ratio of the stops: how much of a blow's energy they keep
INTERNAL_SIZE = 15
RIDER = 0.0
CEILING = 1.0
TURNING = 2.0

# Local state of the body: see dynamics.py. Internal coordinates follow, then their rates
POSITION = 0
ROTATION = 3
VELOCITY = 6
RATE = 9
BODY_STATE = 12

# What a cable does at the moment
RIGID = 0  # length kept; where cables only pull, it turns SLACK when its tension would be negative
ELASTIC = 1  # stretches; pulls only
ELASTIC_ROD = 2  # stretches; pulls and pushes
SLACK = 3  # no tension

# Raw outputs of a node: see integrate.py
OUT_POSITION = 0  # 3: datum in world, m
OUT_ROTATION = 3  # 3: (derivatives only) right-hand rotation increment, rad, body axes
OUT_RATE = 6  # 3: rad/s, body axes
OUT_SPECIFIC_FORCE = 9  # 3: acceleration of the datum less gravity, body axes, m/s^2
OUT_ANGULAR_ACCELERATION = 12  # 3: rad/s^2, body axes
OUT_GRAVITY = 15  # 3: acceleration of gravity, body axes, m/s^2
OUT_TENSION = 18  # n: N


def cable_offset(index: int) -> int:
    """First entry of cable ``index`` in ``physics``."""
    return CABLES + CABLE_SIZE * index


def effects_offset(cables: int) -> int:
    """First entry of the effects' block (effects/place.py) in ``physics``."""
    return CABLES + CABLE_SIZE * cables
