"""What mechanics keeps: energy, cable lengths, momentum; and that no frame is special."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation
from test_model_rigs import (
    Sample,
    cable_lengths,
    moving,
    random_sample,
    thesis_case_14,
    trifilar,
    unloaded_lengths,
)

from rig_identification.model import layout
from rig_identification.model.body import point_inertia, tensor
from rig_identification.model.motion import Input, Motion, RigModel, State, on_cables, simulate

Array = NDArray[np.float64]


def body_numbers(model: RigModel) -> tuple[float, Array, Array, Array]:
    """(m, c, J about c, gravity)."""
    inertial = model.physics[layout.INERTIAL : layout.INERTIAL + 10]
    mass, center = float(inertial[0]), inertial[1:4] / inertial[0]
    return mass, center, tensor(inertial[4:]) - point_inertia(mass, center), model.physics[:3]


def kinetic_and_potential(model: RigModel, motion: Motion) -> tuple[Array, Array]:
    """(N,) J each, from the velocity and height of the centre of mass and the stretch of the cables."""
    mass, center, J, gravity = body_numbers(model)
    R, x, w = motion.R_world_body, motion.states[:, :3], motion.states[:, 9:12]
    velocity = motion.states[:, 6:9] + np.einsum("nij,nj->ni", R, np.cross(w, center))
    kinetic = 0.5 * mass * np.sum(velocity**2, axis=1) + 0.5 * np.einsum("ni,ij,nj->n", w, J, w)
    potential = -mass * (x + R @ center) @ gravity
    unloaded = unloaded_lengths(model)
    stiffness = model.cable_numbers()[:, layout.AXIAL_STIFFNESS]
    stretch = cable_lengths(model, x, R) - unloaded
    return kinetic, potential + 0.5 * np.sum(stiffness / unloaded * stretch**2, axis=1)


@pytest.mark.parametrize("rods", [False, True], ids=["cables", "rods"])
@pytest.mark.parametrize("sample", [thesis_case_14(), trifilar()], ids=["case_14", "trifilar"])
def test_250_s_of_large_swing_keep_energy_and_lengths(sample: Sample, rods: bool) -> None:
    model = sample.model(rods=rods)
    motion = simulate(model, sample.start, Input.none(25001, 0.01))
    assert motion.complete
    kinetic, potential = kinetic_and_potential(model, motion)
    total = kinetic + potential
    # Against the energy of the swing itself, not against a height that depends on the world's origin
    swing = np.max(kinetic)
    assert swing > 50.0
    if not rods:
        assert np.min(motion.outputs[:, layout.OUT_TENSION :]) > 0.0
    assert np.max(np.abs(total - total[0])) <= 1e-5 * swing
    lengths = cable_lengths(model, motion.states[:, :3], motion.R_world_body)
    assert np.max(np.abs(lengths - unloaded_lengths(model))) <= 1e-9


@pytest.mark.parametrize("cables", [3, 4])
def test_elastic_cables_without_damping_keep_energy(cables: int) -> None:
    sample = random_sample(3, cables)
    model = sample.model(axial_stiffness=5e6, rods=True)
    motion = simulate(model, sample.start, Input.none(1001, 0.01), substeps=20)
    kinetic, potential = kinetic_and_potential(model, motion)
    total = kinetic + potential
    assert np.max(np.abs(total - total[0])) <= 1e-5 * np.max(kinetic)


@given(st.integers(0, 10_000), st.integers(2, 6))
@settings(max_examples=12, deadline=None, derandomize=True)
def test_rigid_lengths_and_energy_hold_on_any_rig(seed: int, cables: int) -> None:
    sample = random_sample(seed, cables)
    model = sample.model(rods=True)
    motion = simulate(model, moving(sample, model, seed), Input.none(501, 0.01))
    assert motion.complete
    lengths = cable_lengths(model, motion.states[:, :3], motion.R_world_body)
    assert np.max(np.abs(lengths - unloaded_lengths(model))) <= 1e-9
    kinetic, potential = kinetic_and_potential(model, motion)
    total = kinetic + potential
    assert np.max(np.abs(total - total[0])) <= 1e-6 * max(float(np.max(kinetic)), 1.0)
    orthogonal = motion.R_world_body.transpose(0, 2, 1) @ motion.R_world_body
    assert np.max(np.abs(orthogonal - np.eye(3))) < 1e-12


def driven(nodes: int, step: float, seed: int) -> Input:
    """A smooth exciter force and a wrench held over each interval."""
    rng = np.random.default_rng(seed)
    t = step * np.arange(nodes)[:, None]
    f, phase = rng.uniform(0.4, 1.8, 3), rng.uniform(0.0, 6.0, 3)
    force = 200.0 * np.sin(2.0 * np.pi * f * t + phase)
    rate = 200.0 * 2.0 * np.pi * f * np.cos(2.0 * np.pi * f * t + phase)
    return Input(step, force, rate, np.zeros((nodes, 6)))


def forces_on(model: RigModel, motion: Motion, force: Array) -> tuple[Array, Array]:
    """(N, 3) resultant and (N, 3) moment about the world's origin of weight, cables and exciter."""
    mass, center, _, gravity = body_numbers(model)
    R, x = motion.R_world_body, motion.states[:, :3]
    total = np.tile(mass * gravity, (x.shape[0], 1))
    moment = np.cross(x + R @ center, total)
    for i, block in enumerate(model.cable_numbers()):
        hinge = x + R @ block[3:6]
        along = block[0:3] - hinge
        pull = motion.outputs[:, layout.OUT_TENSION + i, None] * along
        pull /= np.linalg.norm(along, axis=1, keepdims=True)
        total += pull
        moment += np.cross(hinge, pull)
    push = np.einsum("nij,nj->ni", R @ model.exciter_orientation, force)
    at = x + R @ model.physics[layout.EXCITER_POSITION : layout.EXCITER_POSITION + 3]
    return total + push, moment + np.cross(at, push)


@pytest.mark.parametrize("axial_stiffness", [None, 2e6], ids=["rigid", "elastic"])
@pytest.mark.parametrize("cables", [2, 3, 5])
def test_momentum_changes_by_the_impulse_of_the_forces(cables: int, axial_stiffness: float | None) -> None:
    sample = random_sample(11, cables)
    model = sample.model(axial_stiffness=axial_stiffness, rods=True)
    drive = driven(2001, 0.001, 5)
    motion = simulate(model, moving(sample, model, 2), drive)
    mass, center, J, _ = body_numbers(model)
    R, w = motion.R_world_body, motion.states[:, 9:12]
    position = motion.states[:, :3] + R @ center
    velocity = motion.states[:, 6:9] + np.einsum("nij,nj->ni", R, np.cross(w, center))
    linear = mass * velocity
    angular = np.cross(position, linear) + np.einsum("nij,nj->ni", R, w @ J)
    force, moment = forces_on(model, motion, drive.force)
    for momentum, cause in ((linear, force), (angular, moment)):
        impulse = simpson(cause, dx=0.001, axis=0)
        size = simpson(np.linalg.norm(cause, axis=1), dx=0.001)
        np.testing.assert_allclose(momentum[-1] - momentum[0], impulse, atol=2e-7 * max(size, 1.0))


def test_outputs_are_the_derivatives_of_the_motion() -> None:
    sample = random_sample(4, 3)
    model = sample.model(rods=True)
    motion = simulate(model, moving(sample, model, 4), driven(4001, 0.0005, 1))
    acceleration = np.gradient(motion.states[:, 6:9], 0.0005, axis=0, edge_order=2)
    felt = np.einsum("nji,nj->ni", motion.R_world_body, acceleration - model.physics[:3])
    out = motion.outputs
    np.testing.assert_allclose(out[:, 9:12], felt, atol=2e-4)
    alpha = np.gradient(motion.states[:, 9:12], 0.0005, axis=0, edge_order=2)
    np.testing.assert_allclose(out[:, 12:15], alpha, atol=2e-4)
    turns = Rotation.from_matrix(motion.R_world_body)
    mean_rate = (turns[:-2].inv() * turns[2:]).as_rotvec() / 0.001
    np.testing.assert_allclose(out[1:-1, 6:9], mean_rate, atol=1e-5)
    np.testing.assert_allclose(out[:, 15:18], motion.R_world_body.transpose(0, 2, 1) @ model.physics[:3])


@given(st.integers(0, 10_000), st.integers(2, 5))
@settings(max_examples=6, deadline=None, derandomize=True)
def test_a_turned_and_shifted_world_sees_the_same_motion(seed: int, cables: int) -> None:
    sample = random_sample(seed, cables)
    model = sample.model(rods=True)
    state, drive = moving(sample, model, seed), driven(301, 0.01, seed)
    rng = np.random.default_rng(seed)
    Q = Rotation.from_rotvec(rng.uniform(-2.0, 2.0, 3)).as_matrix()
    shift = rng.uniform(-3.0, 3.0, 3)
    physics = model.physics.copy()
    physics[:3] = Q @ physics[:3]
    for i in range(cables):
        o = layout.cable_offset(i)
        physics[o : o + 3] = Q @ physics[o : o + 3] + shift
    moved = State(Q @ state.position + shift, Q @ state.R_world_body, Q @ state.velocity, state.rate)
    one = simulate(model, state, drive)
    other = simulate(model.with_physics(physics), moved, drive)
    np.testing.assert_allclose(other.states[:, :3], one.states[:, :3] @ Q.T + shift, atol=1e-9)
    np.testing.assert_allclose(other.R_world_body, Q @ one.R_world_body, atol=1e-9)
    np.testing.assert_allclose(
        other.outputs[:, layout.OUT_RATE : layout.OUT_TENSION],
        one.outputs[:, layout.OUT_RATE : layout.OUT_TENSION],
        atol=1e-7,
    )
    np.testing.assert_allclose(
        other.outputs[:, layout.OUT_TENSION :], one.outputs[:, layout.OUT_TENSION :], atol=1e-4
    )


@given(st.integers(0, 10_000), st.integers(2, 5))
@settings(max_examples=6, deadline=None, derandomize=True)
def test_another_datum_sees_the_same_motion(seed: int, cables: int) -> None:
    """Every body-side point is measured from a datum; which one is a choice."""
    sample = random_sample(seed, cables)
    d = np.random.default_rng(seed).uniform(-1.0, 1.0, 3)
    rig, elements = sample.rig, sample.elements.copy()
    elements[1:4] -= d
    assert rig.exciter is not None
    other_rig = replace(
        rig,
        cables=tuple(replace(c, body_point=c.body_point - d) for c in rig.cables),
        exciter=replace(rig.exciter, position=rig.exciter.position - d),
    )
    model = sample.model(rods=True)
    state, drive = moving(sample, model, seed), driven(301, 0.01, seed)
    R = state.R_world_body
    moved = State(state.position + R @ d, R, state.velocity + R @ np.cross(state.rate, d), state.rate)
    one = simulate(model, state, drive)
    other = simulate(replace(sample, rig=other_rig, elements=elements).model(rods=True), moved, drive)
    np.testing.assert_allclose(other.states[:, :3], one.states[:, :3] + one.R_world_body @ d, atol=1e-7)
    np.testing.assert_allclose(other.R_world_body, one.R_world_body, atol=1e-7)
    np.testing.assert_allclose(
        other.outputs[:, layout.OUT_TENSION :], one.outputs[:, layout.OUT_TENSION :], atol=2e-2
    )


def test_a_push_from_below_slackens_cables_that_catch_again() -> None:
    sample = random_sample(1, 4)
    model = sample.model()
    rest = on_cables(model, sample.start)
    nodes = 401
    lift = np.zeros((nodes, 6))
    R = rest.R_world_body
    # 1.3 times the weight for a quarter of a second, at the datum: cables let go at different times
    lift[20:45, :3] = R.T @ [0.0, 0.0, 1.3 * sample.elements[0] * 9.80665]
    drive = Input(0.01, np.zeros((nodes, 3)), np.zeros((nodes, 3)), lift)
    motion = simulate(model, rest, drive)
    assert motion.complete
    assert np.all(np.isfinite(motion.outputs))
    tension = motion.outputs[:, layout.OUT_TENSION :]
    slack = tension == 0.0
    assert np.all(np.any(slack, axis=0)), "every cable goes slack"
    assert np.min(tension) >= 0.0
    assert np.all(tension[-100:].max(axis=0) > 0.0), "and pulls again"
    excess = cable_lengths(model, motion.states[:, :3], motion.R_world_body) - unloaded_lengths(model)
    assert np.max(excess) <= 1e-3
    assert np.min(excess) < -1e-3
    # A cable that snaps tight takes energy, it never gives any
    kinetic, potential = kinetic_and_potential(model, motion)
    total = (kinetic + potential)[46:]
    assert np.max(np.diff(total)) <= 1e-4 * np.max(kinetic)


def test_rods_push_where_cables_let_go() -> None:
    sample = random_sample(1, 4)
    nodes = 60
    lift = np.zeros((nodes, 6))
    lift[:, 2] = 1.5 * sample.elements[0] * 9.80665
    drive = Input(0.01, np.zeros((nodes, 3)), np.zeros((nodes, 3)), lift)
    model = sample.model(rods=True)
    motion = simulate(model, sample.start, drive)
    assert np.min(motion.outputs[:, layout.OUT_TENSION :]) < 0.0
    lengths = cable_lengths(model, motion.states[:, :3], motion.R_world_body)
    assert np.max(np.abs(lengths - unloaded_lengths(model))) <= 1e-9
