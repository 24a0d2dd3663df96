"""Left-out physics switched on in a simulated plant: the effects that estimator and plant share.

What an effect does to the motion stands in ``model/effects/``; here its numbers are put where the
forward model looks for them. The switches that people set are in :mod:`plant_switches`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.live.push import Push
from rig_identification.model import layout
from rig_identification.model.edges import edge_shifts
from rig_identification.model.effects import place
from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.motion import RigModel, State

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rider:
    """A mass that moves against the body. The body's ten numbers count it as fixed at its place."""

    mass: float  # kg
    position: Array  # (3,) m, body frame: where it rests
    directions: Array  # (k, 3) unit vectors, body axes; of a liquid none: it swings to all sides
    frequency: float  # Hz
    damping_ratio: float
    stop: float = 0.0  # m each way to its stops; 0: none
    stop_damping: float = 0.0  # damping ratio of its stops
    along: Array = field(default_factory=lambda: np.zeros(3))  # Hz along body axes; 0: ``frequency`` alone

    def blocks(self, R_rest: Array) -> Array:
        """(k, INTERNAL_SIZE) numbers of its coordinates (model/layout.py). R_rest: body in world at rest."""
        hangs = self.directions.shape[0] == 0
        every = bool(np.any(self.along))
        axes = (
            R_rest[:2] if hangs else np.eye(3) if every else self.directions
        )  # horizontal ones, of a liquid
        out = np.zeros((axes.shape[0], layout.INTERNAL_SIZE))
        out[:, layout.AXIS : layout.AXIS + 3] = axes
        out[0, layout.MASS] = self.mass
        out[0, layout.POINT : layout.POINT + 3] = self.position
        out[0, layout.FREQUENCY], out[0, layout.DAMPING_RATIO] = self.frequency, self.damping_ratio
        if every:
            out[:, layout.FREQUENCY] = np.where(self.along > 0.0, self.along, self.frequency)
        out[0, layout.STOP], out[0, layout.STOP_DAMPING] = self.stop, self.stop_damping
        out[0, layout.PENDULUM] = float(hangs)
        return out


@dataclass(frozen=True)
class YieldingCeiling:
    """The upper hinges move together, along each world axis that has a stiffness."""

    stiffness: Array  # (3,) N/m; 0: does not yield
    mass: float  # kg that moves with the hinges
    damping_ratio: float

    def blocks(self) -> Array:
        """(k, INTERNAL_SIZE) numbers of its coordinates (model/layout.py)."""
        axes = np.flatnonzero(self.stiffness > 0.0)
        out = np.zeros((axes.size, layout.INTERNAL_SIZE))
        out[:, layout.KIND], out[:, layout.LEADER] = layout.CEILING, np.arange(axes.size)
        out[np.arange(axes.size), layout.AXIS + axes] = 1.0
        out[:, layout.COMPLIANCE] = 1.0 / self.stiffness[axes]
        out[:, layout.FREQUENCY] = np.sqrt(self.stiffness[axes] / self.mass) / (2.0 * np.pi)
        out[:, layout.DAMPING_RATIO] = self.damping_ratio
        return out


@dataclass(frozen=True)
class PlantEffects:
    """How the plant differs from the ideal rig of its description; as it comes: not at all."""

    hinge_damping: Array | float = 0.0  # N m s/rad, hinges of each cable or of all
    hinge_friction: Array | float = 0.0  # N m, hinges of each cable or of all
    hinge_bending: Array = field(default_factory=lambda: np.zeros(2))  # N m s/rad, at ceiling and body
    held_ends: Array = field(default_factory=lambda: np.zeros((1, 3)))  # N m/rad, xx xy yy, each cable or all
    air_drag: float = 0.0  # m^2, Cd A
    air_plates: Array = field(default_factory=lambda: np.zeros(2))  # m^2, Cd A of sides facing body x and y
    plate_reach: float = 0.5  # m
    air_plate: float = 0.0  # m^2, Cd A of one flat side
    air_plate_normal: Array = field(default_factory=lambda: np.zeros(2))  # rad, azimuth and elevation, body
    air_plate_point: Array = field(default_factory=lambda: np.zeros(3))  # m, body
    air_plate_along: float = 0.0  # 1, share of the speed along it that counts
    spin: Array = field(default_factory=lambda: np.zeros(3))  # N m s, body: of what spins on the body
    turning_cube: float = 0.0  # N m
    air_added_mass: float = 0.0  # kg
    air_carried: Array = field(default_factory=lambda: np.zeros(3))  # kg, along body axes
    air_carried_point: Array = field(default_factory=lambda: np.zeros(3))  # m, body
    exciter_rotor: float = 0.0  # kg
    cable_mass: float = 0.0  # kg/m
    cable_torsion: float = 0.0  # N m/rad, each cable
    cable_twist: Array = field(default_factory=lambda: np.zeros(3))  # N m, world: of each cable at rest
    axial_stiffness: float = 0.0  # N, EA of the cables; 0: inextensible
    axial_damping_ratio: float = 0.0  # of the body's bounce on its cables
    tether: Array = field(default_factory=lambda: np.zeros(3))  # N/m, world axes
    tether_point: Array = field(default_factory=lambda: np.zeros(3))  # m, body
    tether_pull: Array = field(default_factory=lambda: np.zeros(3))  # N, world axes
    tether_reach: Array = field(default_factory=lambda: np.zeros(3))  # m, world; 0: a spring on each axis
    tether_damping: float = 0.0  # N s/m, along its reach
    law_spring: Array = field(default_factory=lambda: np.zeros(3))  # N/m, N/m^2, N/m^3
    law_brake: Array = field(default_factory=lambda: np.zeros(2))  # N s/m, N s^2/m^2
    law_point: Array = field(default_factory=lambda: np.zeros(3))  # m, body
    law_line: Array = field(default_factory=lambda: np.zeros(2))  # rad, azimuth and elevation
    law_narrow: float = 0.0  # 1/m^2
    law_saturation: float = 0.0  # s^2/m^2
    law_upright: float = 1.0  # 1
    law_across: float = 1.0  # 1
    exciter_gain: float = 0.0  # 0.01: the true force is 1 % above the measured one
    cable_length: Array = field(default_factory=lambda: np.zeros(1))  # m that cables are longer, each or all
    ceiling_points: Array = field(default_factory=lambda: np.zeros((1, 3)))  # (n, 3) m, world: hinges' errors
    body_points: Array = field(default_factory=lambda: np.zeros((1, 3)))  # (n, 3) m, body: hinges' errors
    level_error: Array = field(default_factory=lambda: np.zeros(2))  # rad, ceiling tilted about world x and y
    cable_edge: float = 0.0  # m, radius of what every cable bends over at the ceiling
    gyroscopic_share: float = 0.0  # of the gyroscopic moment that is left out; in nature none
    riders: tuple[Rider, ...] = ()
    ceiling: YieldingCeiling | None = None
    own: tuple[tuple[float, ...], ...] = ()  # numbers of each of the lab's own effects (own.py)
    push: Push | None = None  # acts through the motion's input, not through the model's numbers


def with_effects(model: RigModel, effects: PlantEffects) -> RigModel:
    """The same rig with ``effects``.

    A tether pulls and cables are twisted as told, and a rider's spring bears its weight, where the rig hangs
    at rest without these.
    """
    elastic = _elastic(model, effects)
    physics = _with_rig_errors(elastic, effects)
    block = place.effects_block(model.cables)
    for shared, own, given in (
        (place.DAMPING, layout.HINGE_DAMPING, effects.hinge_damping),
        (place.FRICTION, layout.HINGE_FRICTION, effects.hinge_friction),
    ):
        each = np.broadcast_to(given, model.cables)
        physics[block + shared] = np.min(each)
        for i, more in enumerate(each - np.min(each)):
            physics[layout.cable_offset(i) + own] = more
    physics[block + place.BENDING : block + place.BENDING + 2] = effects.hinge_bending
    physics[block + place.LEANING] = float(np.any(effects.held_ends))
    for i, held in enumerate(np.broadcast_to(effects.held_ends, (model.cables, 3))):
        o = layout.cable_offset(i)
        physics[o + layout.LEAN : o + layout.LEAN + 3] = held
    physics[block + place.DRAG_AREA] = effects.air_drag
    physics[block + place.PLATES : block + place.PLATES + 2] = effects.air_plates
    physics[block + place.PLATE_REACH] = effects.plate_reach
    physics[block + place.AIR_PLATE] = effects.air_plate
    physics[block + place.AIR_PLATE_NORMAL : block + place.AIR_PLATE_NORMAL + 2] = effects.air_plate_normal
    physics[block + place.AIR_PLATE_POINT : block + place.AIR_PLATE_POINT + 3] = effects.air_plate_point
    physics[block + place.AIR_PLATE_ALONG] = effects.air_plate_along
    physics[block + place.SPIN : block + place.SPIN + 3] = effects.spin
    physics[block + place.TURNING_CUBE] = effects.turning_cube
    physics[block + place.ADDED_MASS] = effects.air_added_mass
    physics[block + place.AIR_CARRIED : block + place.AIR_CARRIED + 3] = effects.air_carried
    physics[block + place.AIR_CARRIED_POINT : block + place.AIR_CARRIED_POINT + 3] = effects.air_carried_point
    physics[block + place.ROTOR_MASS] = effects.exciter_rotor
    physics[block + place.LINEAR_DENSITY] += effects.cable_mass
    physics[block + place.TORSION] = effects.cable_torsion
    physics[block + place.GYROSCOPIC_SHARE] = effects.gyroscopic_share
    rest = _rest(elastic.with_physics(physics))
    physics = elastic.with_physics(physics).referred(rest).physics
    physics[block + place.TWISTED : block + place.TWISTED + 3] = effects.cable_twist
    physics[block + place.TETHER_STIFFNESS : block + place.TETHER_STIFFNESS + 3] = effects.tether
    physics[block + place.TETHER_POINT : block + place.TETHER_POINT + 3] = effects.tether_point
    physics[block + place.TETHER_PULL : block + place.TETHER_PULL + 3] = effects.tether_pull
    physics[block + place.TETHER_REACH : block + place.TETHER_REACH + 3] = effects.tether_reach
    physics[block + place.TETHER_DAMPING] = effects.tether_damping
    physics[block + place.LAW_SPRING : block + place.LAW_SPRING + 3] = effects.law_spring
    physics[block + place.LAW_BRAKE : block + place.LAW_BRAKE + 2] = effects.law_brake
    physics[block + place.LAW_POINT : block + place.LAW_POINT + 3] = effects.law_point
    physics[block + place.LAW_DIRECTION : block + place.LAW_DIRECTION + 2] = effects.law_line
    physics[block + place.LAW_NARROW] = effects.law_narrow
    physics[block + place.LAW_SATURATION] = effects.law_saturation
    physics[block + place.LAW_UPRIGHT] = effects.law_upright
    physics[block + place.LAW_ACROSS] = effects.law_across
    for k, numbers in enumerate(effects.own):
        first = place.own_block(block, k) + place.OWN_NUMBERS
        physics[first : first + len(numbers)] = numbers
    out = elastic.with_physics(physics)
    for rider in effects.riders:
        out = out.with_internal(rider.blocks(rest.R_world_body))
    return out if effects.ceiling is None else out.with_internal(effects.ceiling.blocks())


def _rest(model: RigModel) -> State:
    guess = settle(model, design_pose(model))
    rest = find_rest(model, guess)
    return rest.state if rest.converged else guess


def _elastic(model: RigModel, effects: PlantEffects) -> RigModel:
    """Cables that stretch, all alike; those that cannot go slack push as well."""
    if effects.axial_stiffness <= 0.0:
        return model
    n = model.cables
    physics = model.physics.copy()
    offsets = np.array([layout.cable_offset(i) for i in range(n)])
    stiffness = effects.axial_stiffness * float(np.sum(1.0 / physics[offsets + layout.LENGTH]))
    bounce = np.sqrt(stiffness / physics[layout.INERTIAL])
    physics[offsets + layout.AXIAL_STIFFNESS] = effects.axial_stiffness
    physics[offsets + layout.AXIAL_DAMPING] = 2.0 * effects.axial_damping_ratio / bounce
    modes = np.where(model.can_slacken, layout.ELASTIC, layout.ELASTIC_ROD).astype(np.int64)
    return replace(model, physics=physics, modes=modes, can_slacken=np.zeros(n, dtype=np.bool_))


def _with_rig_errors(model: RigModel, effects: PlantEffects) -> Array:
    """Numbers of a rig whose geometry and exciter are not as described."""
    n = model.cables
    physics = model.physics.copy()
    physics[layout.EXCITER_GAIN] *= 1.0 + effects.exciter_gain
    ceiling, body = (np.broadcast_to(e, (n, 3)) for e in (effects.ceiling_points, effects.body_points))
    for i, error in enumerate(np.broadcast_to(effects.cable_length, (n,))):
        o = layout.cable_offset(i)
        physics[o + layout.LENGTH] += error
        physics[o + layout.CEILING_POINT : o + layout.CEILING_POINT + 3] += ceiling[i]
        physics[o + layout.BODY_POINT : o + layout.BODY_POINT + 3] += body[i]
    for entry, change in edge_shifts(model) if effects.cable_edge > 0.0 else ():
        physics[entry] += effects.cable_edge * change
    # A ceiling tilted against gravity is gravity tilted against the ceiling
    tilt = Rotation.from_rotvec([effects.level_error[0], effects.level_error[1], 0.0])
    gravity = physics[layout.GRAVITY : layout.GRAVITY + 3]
    physics[layout.GRAVITY : layout.GRAVITY + 3] = tilt.inv().apply(gravity)
    return np.asarray(physics)
