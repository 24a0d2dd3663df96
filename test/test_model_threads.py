"""Bodies on threads: hinges that hold against rolling or twist freely, and air that is stirred."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from test_model_conservation import kinetic_and_potential
from test_model_derivatives import (
    SUBSTEPS,
    assert_close,
    check_physics,
    drive_of,
    physics_derivative,
)
from test_model_gyroscopic import SPIN, falling, spinning
from test_model_rigs import Sample, moving, random_sample, thesis_case_14

from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.equilibrium import design_pose, settle
from rig_identification.model.modes import natural_modes
from rig_identification.model.motion import Input, Motion, RigModel, State, rig_model, simulate
from rig_identification.rig import Cable, Rig

Array = NDArray[np.float64]
AXIS = np.array([1.0, 0.0, 0.0])


def having(model: RigModel, **amounts: float | np.ndarray) -> RigModel:
    """The model with amounts of effects, or several at once, by their names in place.py."""
    physics = model.physics.copy()
    for name, value in amounts.items():
        first = place.effects_block(model.cables) + getattr(place, name)
        physics[first : first + np.size(value)] = value
    return model.with_physics(physics)


def rolling(model: RigModel, start: State, stiffness: float, skew: float = 0.0) -> RigModel:
    """The model with hinges that are without strain at ``start``."""
    physics = model.referred(start).physics
    physics[place.effects_block(model.cables) + place.ROLL_AXIS :][:3] = AXIS
    return having(model.with_physics(physics), ROLL_STIFFNESS=stiffness, ROLL_SKEW=skew)


def cables_in_body(model: RigModel, position: np.ndarray, R: np.ndarray) -> np.ndarray:
    """(n, 3) unit vectors from ceiling to body hinge, body axes."""
    out = []
    for i in range(model.cables):
        o = layout.cable_offset(i)
        ceiling = model.physics[o + layout.CEILING_POINT :][:3]
        d = R.T @ (position - ceiling) + model.physics[o + layout.BODY_POINT :][:3]
        out.append(d / np.linalg.norm(d))
    return np.array(out)


def strain_energy(model: RigModel, motion: Motion, start: State, stiffness: float, skew: float) -> np.ndarray:
    up = start.R_world_body.T @ [0.0, 0.0, 1.0]
    axis = AXIS + skew * np.cross(up, AXIS)
    axis /= np.linalg.norm(axis)
    rest = cables_in_body(model, start.position, start.R_world_body)
    turned = [
        float(np.mean(np.cross(rest, cables_in_body(model, x[:3], R)) @ axis))
        for x, R in zip(motion.states, motion.R_world_body, strict=True)
    ]
    return 0.5 * stiffness * np.array(turned) ** 2


@pytest.mark.parametrize("skew", [0.0, 0.6])
def test_hinges_that_hold_against_rolling_keep_energy(skew: float) -> None:
    sample, stiffness = thesis_case_14(), 3e4
    model = rolling(sample.model(rods=True), sample.start, stiffness, skew)
    motion = simulate(model, sample.start, Input.none(501, 0.01), substeps=8)
    kinetic, potential = kinetic_and_potential(model, motion)
    strain = strain_energy(model, motion, sample.start, stiffness, skew)
    assert np.max(strain) > 0.01 * np.ptp(kinetic)
    assert np.ptp(kinetic + potential + strain) < 1e-6 * np.ptp(kinetic)


def test_hinges_that_bend_but_twist_freely_lack_the_twist_alone() -> None:
    """Power: each of a cable's two hinges takes c (w/2)^2 of the body's twist w about the cable."""
    sample, damping = random_sample(4, 2), 30.0
    plain = sample.model(rods=True)
    start = moving(sample, plain, 4)
    lost = {}
    for name, amount in (("DAMPING", damping), ("BENDING", np.full(2, damping))):
        model = having(plain, **{name: amount})
        motion = simulate(model, start, Input.none(3, 1e-4), substeps=4)
        energy = np.sum(kinetic_and_potential(model, motion), axis=0)
        lost[name] = -(energy[2] - energy[0]) / 2e-4
    twist = cables_in_body(plain, start.position, start.R_world_body) @ start.rate
    assert lost["BENDING"] > 0.0
    np.testing.assert_allclose(lost["DAMPING"] - lost["BENDING"], damping * np.sum(twist**2) / 2.0, rtol=1e-2)


def test_ends_that_damp_each_for_itself_take_what_both_take_together() -> None:
    sample, damping = random_sample(4, 2), 30.0
    plain = sample.model(rods=True)
    start = moving(sample, plain, 4)

    def lost(upper: float, lower: float) -> float:
        model = having(plain, BENDING=[upper, lower])
        motion = simulate(model, start, Input.none(3, 1e-4), substeps=4)
        energy = np.sum(kinetic_and_potential(model, motion), axis=0)
        return float(energy[0] - energy[2])

    both, least = lost(damping, damping), lost(0.0, 0.0)
    assert lost(damping, 0.0) > least
    assert lost(0.0, damping) > least
    assert lost(damping, 0.0) + lost(0.0, damping) - least == pytest.approx(both, rel=1e-3)


HELD = np.array([[3e3, -1e3, 2e3], [-1e3, 2e3, 4e3], [5e3, 0.0, 0.0]])


def held(model: RigModel, start: State, stiffness: Array) -> RigModel:
    """The model with upper ends (n, 3) that hold nothing at ``start``."""
    physics = model.referred(start).physics.copy()
    for i in range(model.cables):
        physics[layout.cable_offset(i) + layout.LEAN :][:3] = stiffness[i]
    return having(model.with_physics(physics), LEANING=1.0)


def test_upper_ends_that_hold_their_cables_keep_energy() -> None:
    sample = random_sample(6, 3)
    plain = sample.model(rods=True)
    model = held(plain, sample.start, HELD)
    motion = simulate(model, moving(sample, plain, 6), Input.none(301, 0.005), substeps=8)
    kinetic, potential = kinetic_and_potential(model, motion)
    # Directions in the world: R of those in the body
    rest = (
        cables_in_body(model, sample.start.position, sample.start.R_world_body) @ sample.start.R_world_body.T
    )
    lean = (
        np.array(
            [
                cables_in_body(model, x[:3], R) @ R.T
                for x, R in zip(motion.states, motion.R_world_body, strict=True)
            ]
        )[:, :, :2]
        - rest[None, :, :2]
    )
    xx, xy, yy = HELD.T
    strain = np.sum(
        0.5 * xx * lean[..., 0] ** 2 + xy * lean[..., 0] * lean[..., 1] + 0.5 * yy * lean[..., 1] ** 2, axis=1
    )
    assert np.ptp(strain) > 0.01 * np.ptp(kinetic)
    assert np.ptp(kinetic + potential + strain) < 1e-6 * np.ptp(kinetic)


def test_a_cable_that_ends_in_a_loop_swings_in_its_plane_as_a_shorter_one() -> None:
    """Three parallel cables and a body that only sways: w^2 = g/l across the loops, g/(l - h) along them."""
    length, height, gravity, mass = 1.5, 0.2, 9.80665, 6.0
    points = 0.4 * np.array([[1.0, 0.0, 0.0], [-0.5, 0.75**0.5, 0.0], [-0.5, -(0.75**0.5), 0.0]])
    cables = tuple(Cable(f"cable_{i}", p, p, length) for i, p in enumerate(points))
    elements = np.array([mass, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.3, 0.0, 0.4])
    plain = rig_model(Rig(gravity, cables, mass, 0.01), elements)
    rest = settle(plain, design_pose(plain))
    tension = mass * gravity / 3.0
    loops = np.array([[tension * length * height / (length - height), 0.0, 0.0]] * 3)
    model = held(plain, rest, loops)
    sways = {m.shape: m.frequency for m in natural_modes(model, rest)}
    assert sways["sway along x"] == pytest.approx(
        np.sqrt(gravity / (length - height)) / (2 * np.pi), rel=1e-6
    )
    assert sways["sway along y"] == pytest.approx(np.sqrt(gravity / length) / (2 * np.pi), rel=1e-6)


def test_derivatives_in_what_upper_ends_hold_with() -> None:
    sample = random_sample(5, 3)
    plain = sample.model(rods=True)
    model = held(plain, sample.start, HELD)
    state, drive = moving(sample, model, 5), drive_of(61, 0.01, 5)
    o = layout.cable_offset(1)
    check_physics(model, state, drive, [layout.INERTIAL + 3, o + layout.LENGTH, o + layout.BODY_POINT], 1e-6)
    own = np.arange(o + layout.LEAN, o + layout.LEAN + 3)
    exact = simulate(model, state, drive, directions=own, substeps=SUBSTEPS)
    assert exact.J is not None
    for k, entry in enumerate(own):
        numeric = physics_derivative(model, state, drive, int(entry), 1.0)
        assert_close(exact.J[:, :, k], numeric, f"held {k}", 1e-6)


def wrench_left(sample: Sample, start: State, model: RigModel) -> tuple[Array, Array]:
    """Force (3,) besides weight and moment (3,) about the centre of mass, body axes, at ``start``."""
    outputs = simulate(model, start, Input.none(11, 0.01)).outputs[0]
    specific = outputs[layout.OUT_SPECIFIC_FORCE :][:3]
    alpha, rate, center = outputs[layout.OUT_ANGULAR_ACCELERATION :][:3], start.rate, sample.elements[1:4]
    xx, xy, xz, yy, yz, zz = sample.elements[4:]
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    felt = specific + np.cross(alpha, center) + np.cross(rate, np.cross(rate, center))
    return sample.elements[0] * felt, J @ alpha + np.cross(rate, J @ rate)


REACH = 0.7


def plated(model: RigModel, facing_x: float, facing_y: float) -> RigModel:
    """The model with plates in the air."""
    physics = model.physics.copy()
    block = place.effects_block(model.cables)
    physics[block + place.PLATES :][:2] = facing_x, facing_y
    return having(model.with_physics(physics), PLATE_REACH=REACH)


def test_plates_resist_the_air_where_they_stand() -> None:
    sample = random_sample(3, 3)
    start = spinning(sample)
    start = replace(start, velocity=start.velocity + np.array([0.3, -0.5, 0.2]))
    force, moment = wrench_left(sample, start, plated(falling(sample), 40.0, 25.0))
    center = start.R_world_body.T @ start.velocity + np.cross(SPIN, sample.elements[1:4])
    wanted, about = np.zeros(3), np.zeros(3)
    for axis, area in ((0, 40.0), (1, 25.0)):
        for side in (-REACH, REACH):
            at, normal = side * np.eye(3)[1 - axis], np.eye(3)[axis]
            u = (center + np.cross(SPIN, at))[axis]
            push = -0.5 * AIR * 0.5 * area * abs(u) * u * normal
            wanted += push
            about += np.cross(at, push)
    np.testing.assert_allclose(force, wanted, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(moment, about, rtol=1e-6, atol=1e-6)


def test_a_turn_damps_a_slow_swing_in_proportion_to_both() -> None:
    """rho C r |w| v against the swing and 1/2 rho C r^3 |w| w against the turn."""
    sample, area, rate = random_sample(3, 3), 40.0, 2.0
    spin = np.array([0.0, 0.0, rate])
    R = sample.start.R_world_body
    start = State(
        sample.start.position,
        R,
        R @ (np.array([0.01, 0.0, 0.0]) - np.cross(spin, sample.elements[1:4])),
        spin,
    )
    force, moment = wrench_left(sample, start, plated(falling(sample), area, 0.0))
    assert force[0] == pytest.approx(-AIR * area * REACH * rate * 0.01, rel=1e-3)
    assert moment[2] == pytest.approx(-0.5 * AIR * area * REACH**3 * rate**2, rel=1e-3)


def test_a_cube_of_the_turn_turns_back_about_the_vertical() -> None:
    sample, amount, turn = random_sample(3, 3), 300.0, 0.4
    physics = falling(sample).physics.copy()
    block = place.effects_block(falling(sample).cables)
    physics[block + place.REFERENCE_ROTATION :][:9] = sample.start.R_world_body.ravel()
    model = having(falling(sample).with_physics(physics), TURNING_CUBE=amount)
    R = Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix() @ sample.start.R_world_body
    start = State(sample.start.position, R, np.zeros(3), np.zeros(3))
    force, moment = wrench_left(sample, start, model)
    np.testing.assert_allclose(R @ moment, [0.0, 0.0, -amount * np.sin(turn) ** 3], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(force, np.zeros(3), rtol=0.0, atol=1e-7)


def test_derivatives_with_all_of_them() -> None:
    sample = random_sample(5, 3)
    plain = sample.model(rods=True)
    model = having(
        rolling(plated(plain, 5.0, 3.0), sample.start, 2e3, 0.4), BENDING=[20.0, 7.0], TURNING_CUBE=200.0
    )
    state, drive = moving(sample, model, 5), drive_of(61, 0.01, 5)
    o = layout.cable_offset(1)
    entries = [layout.INERTIAL, layout.INERTIAL + 3, layout.INERTIAL + 7, layout.GRAVITY]
    entries += [o + layout.LENGTH, o + layout.BODY_POINT + 1, o + layout.CEILING_POINT]
    check_physics(model, state, drive, entries, 1e-6)
    block = place.effects_block(model.cables)
    names = ("BENDING", "ROLL_STIFFNESS", "ROLL_SKEW", "PLATES", "TURNING_CUBE")
    own = {name: block + getattr(place, name) for name in names}
    own["the other PLATES"] = block + place.PLATES + 1
    own["the other BENDING"] = block + place.BENDING + 1
    exact = simulate(model, state, drive, directions=np.array(list(own.values())), substeps=SUBSTEPS)
    assert exact.J is not None
    for k, (name, entry) in enumerate(own.items()):
        # A cube of the turn moves the tensions by microunits: a step that stands out of their rounding
        numeric = physics_derivative(
            model, state, drive, entry, {"ROLL_SKEW": 0.01, "TURNING_CUBE": 1.0}.get(name, 0.1)
        )
        assert_close(exact.J[:, :, k], numeric, name, 1e-6)
