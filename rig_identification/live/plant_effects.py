"""Left-out physics switched on in a simulated plant: the effects that estimator and plant share."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.equilibrium import design_pose, settle
from rig_identification.model.motion import RigModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlantEffects:
    """How the plant differs from the ideal rig of its description; zero everywhere: not at all."""

    hinge_damping: float = 0.0  # N m s/rad, each hinge
    hinge_friction: float = 0.0  # N m, each hinge
    air_drag: float = 0.0  # m^2, Cd A
    air_added_mass: float = 0.0  # kg
    exciter_rotor: float = 0.0  # kg
    cable_mass: float = 0.0  # kg/m
    tether: Array = field(default_factory=lambda: np.zeros(3))  # N/m, world axes
    tether_point: Array = field(default_factory=lambda: np.zeros(3))  # m, body
    exciter_gain: float = 0.0  # 0.01: the true force is 1 % above the measured one
    cable_length: Array = field(default_factory=lambda: np.zeros(1))  # m that cables are longer, each or all
    level_error: Array = field(default_factory=lambda: np.zeros(2))  # rad, ceiling tilted about world x and y


def with_effects(model: RigModel, effects: PlantEffects) -> RigModel:
    """The same rig with ``effects``; a tether is slack where the ideal rig hangs at rest."""
    physics = model.physics.copy()
    physics[layout.EXCITER_GAIN] = 1.0 + effects.exciter_gain
    for i, error in enumerate(np.broadcast_to(effects.cable_length, (model.cables,))):
        physics[layout.cable_offset(i) + layout.LENGTH] += error
    # A ceiling tilted against gravity is gravity tilted against the ceiling
    tilt = Rotation.from_rotvec([effects.level_error[0], effects.level_error[1], 0.0])
    gravity = physics[layout.GRAVITY : layout.GRAVITY + 3]
    physics[layout.GRAVITY : layout.GRAVITY + 3] = tilt.inv().apply(gravity)
    block = place.effects_block(model.cables)
    physics[block + place.DAMPING] = effects.hinge_damping
    physics[block + place.FRICTION] = effects.hinge_friction
    physics[block + place.DRAG_AREA] = effects.air_drag
    physics[block + place.ADDED_MASS] = effects.air_added_mass
    physics[block + place.ROTOR_MASS] = effects.exciter_rotor
    physics[block + place.LINEAR_DENSITY] = effects.cable_mass
    rest = settle(model, design_pose(model))
    physics[block + place.REFERENCE_POSITION : block + place.REFERENCE_POSITION + 3] = rest.position
    physics[block + place.REFERENCE_ROTATION : block + place.REFERENCE_ROTATION + 9] = (
        rest.R_world_body.ravel()
    )
    physics[block + place.TETHER_STIFFNESS : block + place.TETHER_STIFFNESS + 3] = effects.tether
    physics[block + place.TETHER_POINT : block + place.TETHER_POINT + 3] = effects.tether_point
    return model.with_physics(physics)
