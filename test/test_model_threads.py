"""Bodies on threads: hinges that hold against rolling or twist freely, and air that is stirred."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from test_model_conservation import kinetic_and_potential
from test_model_derivatives import (
    SUBSTEPS,
    assert_close,
    check_physics,
    drive_of,
    outputs_difference,
    richardson,
)
from test_model_gyroscopic import SPIN, falling, spinning
from test_model_rigs import moving, random_sample, thesis_case_14

from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.motion import Input, Motion, RigModel, State, simulate

Array = NDArray[np.float64]
AXIS = np.array([1.0, 0.0, 0.0])


def having(model: RigModel, **amounts: float) -> RigModel:
    """The model with amounts of effects by their names in place.py."""
    physics = model.physics.copy()
    for name, value in amounts.items():
        physics[place.effects_block(model.cables) + getattr(place, name)] = value
    return model.with_physics(physics)


def rolling(model: RigModel, start: State, stiffness: float) -> RigModel:
    """The model with hinges that are without strain at ``start``."""
    physics = model.physics.copy()
    block = place.effects_block(model.cables)
    physics[block + place.REFERENCE_POSITION :][:3] = start.position
    physics[block + place.REFERENCE_ROTATION :][:9] = start.R_world_body.ravel()
    physics[block + place.ROLL_AXIS :][:3] = AXIS
    return having(model.with_physics(physics), ROLL_STIFFNESS=stiffness)


def cables_in_body(model: RigModel, position: np.ndarray, R: np.ndarray) -> np.ndarray:
    """(n, 3) unit vectors from ceiling to body hinge, body axes."""
    out = []
    for i in range(model.cables):
        o = layout.cable_offset(i)
        ceiling = model.physics[o + layout.CEILING_POINT :][:3]
        d = R.T @ (position - ceiling) + model.physics[o + layout.BODY_POINT :][:3]
        out.append(d / np.linalg.norm(d))
    return np.array(out)


def strain_energy(model: RigModel, motion: Motion, start: State, stiffness: float) -> np.ndarray:
    rest = cables_in_body(model, start.position, start.R_world_body)
    turned = [
        float(np.mean(np.cross(rest, cables_in_body(model, x[:3], R)) @ AXIS))
        for x, R in zip(motion.states, motion.R_world_body, strict=True)
    ]
    return 0.5 * stiffness * np.array(turned) ** 2


def test_hinges_that_hold_against_rolling_keep_energy() -> None:
    sample, stiffness = thesis_case_14(), 3e4
    model = rolling(sample.model(rods=True), sample.start, stiffness)
    motion = simulate(model, sample.start, Input.none(501, 0.01), substeps=8)
    kinetic, potential = kinetic_and_potential(model, motion)
    strain = strain_energy(model, motion, sample.start, stiffness)
    assert np.max(strain) > 0.01 * np.ptp(kinetic)
    assert np.ptp(kinetic + potential + strain) < 1e-6 * np.ptp(kinetic)


def test_hinges_that_bend_but_twist_freely_lack_the_twist_alone() -> None:
    """Power: each of a cable's two hinges takes c (w/2)^2 of the body's twist w about the cable."""
    sample, damping = random_sample(4, 2), 30.0
    plain = sample.model(rods=True)
    start = moving(sample, plain, 4)
    lost = {}
    for name in ("DAMPING", "BENDING"):
        model = having(plain, **{name: damping})
        motion = simulate(model, start, Input.none(3, 1e-4), substeps=4)
        energy = np.sum(kinetic_and_potential(model, motion), axis=0)
        lost[name] = -(energy[2] - energy[0]) / 2e-4
    twist = cables_in_body(plain, start.position, start.R_world_body) @ start.rate
    assert lost["BENDING"] > 0.0
    np.testing.assert_allclose(lost["DAMPING"] - lost["BENDING"], damping * np.sum(twist**2) / 2.0, rtol=1e-2)


def test_air_resists_turning_with_the_square_of_the_rate() -> None:
    sample, size = random_sample(3, 3), 40.0
    motion = simulate(having(falling(sample), TURNING_DRAG=size), spinning(sample), Input.none(11, 0.01))
    xx, xy, xz, yy, yz, zz = sample.elements[4:]
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    alpha = motion.outputs[0, layout.OUT_ANGULAR_ACCELERATION :][:3]
    moment = J @ alpha + np.cross(SPIN, J @ SPIN)
    np.testing.assert_allclose(moment, -0.5 * AIR * size * np.linalg.norm(SPIN) * SPIN, rtol=1e-6)


def test_derivatives_with_all_of_them() -> None:
    sample = random_sample(5, 3)
    plain = sample.model(rods=True)
    model = having(rolling(plain, sample.start, 2e3), BENDING=20.0, TURNING_DRAG=5.0)
    state, drive = moving(sample, model, 5), drive_of(61, 0.01, 5)
    o = layout.cable_offset(1)
    entries = [layout.INERTIAL, layout.INERTIAL + 3, layout.INERTIAL + 7, layout.GRAVITY]
    entries += [o + layout.LENGTH, o + layout.BODY_POINT + 1, o + layout.CEILING_POINT]
    check_physics(model, state, drive, entries, 1e-6)
    block = place.effects_block(model.cables)
    own = {name: block + getattr(place, name) for name in ("BENDING", "ROLL_STIFFNESS", "TURNING_DRAG")}
    exact = simulate(model, state, drive, directions=np.array(list(own.values())), substeps=SUBSTEPS)
    assert exact.J is not None
    for k, (name, entry) in enumerate(own.items()):

        def difference(h: float, entry: int = entry) -> Array:
            ends = []
            for sign in (1.0, -1.0):
                physics = model.physics.copy()
                physics[entry] += sign * h
                ends.append(simulate(model.with_physics(physics), state, drive, substeps=SUBSTEPS))
            return outputs_difference(*ends, h)

        assert_close(exact.J[:, :, k], richardson(difference, 0.1), name, 1e-6)
