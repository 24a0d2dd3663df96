"""Every effect on the motion, called in turn: adding one is adding its file and its lines here.

What answers to the numbers of cables stands apart: of four cables, a number of one moves a quarter. Whether
an effect is there is asked before it is called as well: the call alone costs more than the question.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.effects.air_added_mass import add_air_added_mass
from rig_identification.model.effects.air_carried import add_air_carried
from rig_identification.model.effects.air_drag import add_air_drag
from rig_identification.model.effects.air_plate import add_air_plate
from rig_identification.model.effects.air_plates import add_air_plates
from rig_identification.model.effects.cable_mass import add_cable_mass
from rig_identification.model.effects.cable_torsion import add_cable_torsion
from rig_identification.model.effects.exciter_rotor import add_exciter_rotor
from rig_identification.model.effects.gyroscopic_share import add_gyroscopic_share
from rig_identification.model.effects.held_ends import add_held_ends
from rig_identification.model.effects.hinge_bending import add_hinge_bending
from rig_identification.model.effects.hinge_damping import add_hinge_damping
from rig_identification.model.effects.hinge_friction import add_hinge_friction
from rig_identification.model.effects.hinge_roll import add_hinge_roll
from rig_identification.model.effects.internal import add_internal
from rig_identification.model.effects.own import add_own, own_active
from rig_identification.model.effects.place import (
    ADDED_MASS,
    AIR_CARRIED,
    AIR_PLATE,
    BENDING,
    DAMPING,
    DRAG_AREA,
    EFFECTS_SIZE,
    FRICTION,
    GYROSCOPIC_SHARE,
    LAW_SPRING,
    LEANING,
    LINEAR_DENSITY,
    PLATES,
    ROLL_STIFFNESS,
    ROTOR_MASS,
    SHARING,
    SPIN,
    TETHER_POINT,
    TETHER_STIFFNESS,
    TORSION,
    TURNING_CUBE,
    active,
)
from rig_identification.model.effects.point_law import add_point_law
from rig_identification.model.effects.spinning_part import add_spinning_part
from rig_identification.model.effects.tether import add_tether
from rig_identification.model.effects.turning_cube import add_turning_cube
from rig_identification.model.layout import (
    BODY_STATE,
    CABLE_SIZE,
    CABLES,
    CEILING,
    HINGE_DAMPING,
    HINGE_FRICTION,
    INTERNAL_SIZE,
    KIND,
)


@njit(cache=True)
def _riders(physics, modes, internal):  # type: ignore[no-untyped-def]
    """Whether any internal coordinate is a mass that rides: a ceiling's feels nothing but the cables."""
    first = CABLES + CABLE_SIZE * modes.shape[0] + EFFECTS_SIZE
    riding = False
    for j in range(internal):
        riding = riding or physics[first + INTERNAL_SIZE * j + KIND].real != CEILING
    return riding


@njit(cache=True)
def effects_reach(physics, modes, internal):  # type: ignore[no-untyped-def]
    """Whether any effect answers to the body's numbers, gravity, the exciter's mount, the cables' numbers."""
    block = CABLES + CABLE_SIZE * modes.shape[0]
    if physics.shape[0] <= block:
        return False, False, False, False
    body = active(physics[block + DRAG_AREA]) or active(physics[block + ADDED_MASS])
    body = body or active(physics[block + GYROSCOPIC_SHARE])
    body = body or active(physics[block + PLATES]) or active(physics[block + PLATES + 1])
    rotor, rods = active(physics[block + ROTOR_MASS]), active(physics[block + LINEAR_DENSITY])
    hinges = active(physics[block + DAMPING]) or active(physics[block + FRICTION])
    hinges = hinges or _any_active(physics, block + BENDING, 2) or active(physics[block + ROLL_STIFFNESS])
    hinges = hinges or _any_active(physics, block + TORSION, 4) or active(physics[block + LEANING])
    hinges = hinges or _hinges_of_any(physics, (0, modes.shape[0]))
    return body, rotor or rods or _riders(physics, modes, internal), rotor, rods or hinges


@njit(cache=True)
def effects_follow(physics, modes, internal):  # type: ignore[no-untyped-def]
    """Whether any effect answers to where the body is or how fast it goes; to how it is turned or turns.

    Hinges, air, cables' own mass and what the body is tied to answer to both; what rides on the body or turns
    with it to the second alone.
    """
    block = CABLES + CABLE_SIZE * modes.shape[0]
    if physics.shape[0] <= block:
        return False, False
    hinges = _hinges_of_any(physics, (0, modes.shape[0]))
    place, turn = hinges, hinges or _riders(physics, modes, internal)
    for i in range(TETHER_POINT):
        if active(physics[block + i]):
            turn = True
            turns_alone = i in (ADDED_MASS, ROTOR_MASS, GYROSCOPIC_SHARE, TURNING_CUBE)
            place = place or not (turns_alone or SPIN <= i < SPIN + 3)
    own = own_active(physics, block)
    return place or own, turn or own


@njit(cache=True)
def in_cable_rows(physics, modes, number):  # type: ignore[no-untyped-def]
    """Whether a number behind the cables' blocks stands in the cables' own equations."""
    block = CABLES + CABLE_SIZE * modes.shape[0]
    if number == block + SHARING:
        return True
    behind = number - block - EFFECTS_SIZE
    return behind >= 0 and physics[number - behind % INTERNAL_SIZE + KIND].real == CEILING


@njit(cache=True)
def add_effects(physics, modes, x, R, K, r):  # type: ignore[no-untyped-def]
    """Add all effects to K z = r."""
    block = CABLES + CABLE_SIZE * modes.shape[0]
    if physics.shape[0] <= block:
        return
    _add_at_cables(physics, block, modes, (0, modes.shape[0]), x, R, K, r)
    if active(physics[block + DRAG_AREA]):
        add_air_drag(physics, block, x, R, r)
    if _any_active(physics, block + PLATES, 2):
        add_air_plates(physics, block, x, R, r)
    if active(physics[block + TURNING_CUBE]):
        add_turning_cube(physics, block, R, r)
    if active(physics[block + ADDED_MASS]):
        add_air_added_mass(physics, block, x, K, r)
    if _any_active(physics, block + AIR_CARRIED, 3):
        add_air_carried(physics, block, x, R, K, r)
    if active(physics[block + ROTOR_MASS]):
        add_exciter_rotor(physics, block, x, R, K, r)
    if active(physics[block + GYROSCOPIC_SHARE]):
        add_gyroscopic_share(physics, block, x, r)
    if _any_active(physics, block + SPIN, 3):
        add_spinning_part(physics, block, x, r)
    if active(physics[block + AIR_PLATE]):
        add_air_plate(physics, block, x, R, r)
    if _any_active(physics, block + TETHER_STIFFNESS, 6):
        add_tether(physics, block, x, R, r)
    if _any_active(physics, block + LAW_SPRING, 5):
        add_point_law(physics, block, x, R, r)
    if own_active(physics, block):
        add_own(physics, block, x, R, r)
    if x.shape[0] > BODY_STATE:
        add_internal(physics, block, modes, x, R, K, r)


@njit(cache=True)
def add_effects_at(physics, modes, cable, x, R, K, r):  # type: ignore[no-untyped-def]
    """Add to K z = r what of all effects answers to one cable's numbers."""
    block = CABLES + CABLE_SIZE * modes.shape[0]
    _add_at_cables(physics, block, modes, (cable, cable + 1), x, R, K, r)


@njit(cache=True)
def _add_at_cables(physics, block, modes, cables, x, R, K, r):  # type: ignore[no-untyped-def]
    """Add what acts at some cables, first to last but one; at all where one cable's share asks for all."""
    own = _hinges_of_any(physics, cables)
    if own or active(physics[block + DAMPING]):
        add_hinge_damping(physics, block, modes, cables, x, R, r)
    if own or active(physics[block + FRICTION]):
        add_hinge_friction(physics, block, modes, cables, x, R, r)
    if _any_active(physics, block + BENDING, 2):
        add_hinge_bending(physics, block, modes, cables, x, R, r)
    if active(physics[block + ROLL_STIFFNESS]):
        add_hinge_roll(physics, block, modes, x, R, r)
    if _any_active(physics, block + TORSION, 4):
        add_cable_torsion(physics, block, modes, cables, x, R, r)
    if active(physics[block + LEANING]):
        add_held_ends(physics, block, modes, cables, x, R, r)
    if active(physics[block + LINEAR_DENSITY]):
        add_cable_mass(physics, block, modes, cables, x, R, K, r)


@njit(cache=True, inline="always")
def _hinges_of_any(physics, cables):  # type: ignore[no-untyped-def]
    """Whether any of some cables, first to last but one, has a moment in its hinges of its own."""
    found = False
    for i in range(cables[0], cables[1]):
        first = CABLES + CABLE_SIZE * i
        found = found or active(physics[first + HINGE_DAMPING]) or active(physics[first + HINGE_FRICTION])
    return found


@njit(cache=True, inline="always")
def _any_active(physics, first, count):  # type: ignore[no-untyped-def]
    """Whether any of so many numbers, or its derivative, is asked for."""
    found = False
    for i in range(first, first + count):
        found = found or active(physics[i])
    return found
