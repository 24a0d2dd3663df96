"""Masses that ride on the body and a ceiling that yields: energy, derivatives, rest and limit cases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from test_model_conservation import driven
from test_model_derivatives import check_physics
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
from rig_identification.model.effects import place
from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.motion import Input, Motion, RigModel, simulate

Array = NDArray[np.float64]
AXES = np.eye(3)


def rider(mass: float, point: Array, axes: Array, frequency: float, damping: float = 0.0) -> Array:
    """Blocks of one rider with a coordinate along each row of ``axes``."""
    blocks = np.zeros((axes.shape[0], layout.INTERNAL_SIZE))
    blocks[:, layout.AXIS : layout.AXIS + 3] = axes
    blocks[0, layout.MASS] = mass
    blocks[0, layout.POINT : layout.POINT + 3] = point
    blocks[0, layout.FREQUENCY], blocks[0, layout.DAMPING_RATIO] = frequency, damping
    return blocks


def pendulum(mass: float, point: Array, frequency: float, damping: float = 0.0) -> Array:
    """Blocks of a liquid that hangs."""
    blocks = rider(mass, point, AXES[:2], frequency, damping)
    blocks[0, layout.PENDULUM] = 1.0
    return blocks


def on_springs(mass: float, point: Array, frequencies: tuple[float, float, float]) -> Array:
    """Blocks of a part with another frequency along each axis."""
    blocks = rider(mass, point, AXES, frequencies[0])
    blocks[:, layout.FREQUENCY] = frequencies
    return blocks


def ceiling(compliance: float, axis: Array, frequency: float, damping: float = 0.0, hinge: int = 0) -> Array:
    """Block of a ceiling that yields along ``axis``. hinge: 0: of all cables; i + 1: of cable i alone."""
    block = np.zeros((1, layout.INTERNAL_SIZE))
    block[0, layout.KIND], block[0, layout.COMPLIANCE] = layout.CEILING, compliance
    block[0, layout.AXIS : layout.AXIS + 3] = axis
    block[0, layout.FREQUENCY], block[0, layout.DAMPING_RATIO] = frequency, damping
    block[0, layout.HINGE] = hinge
    return block


def with_rest(model: RigModel) -> RigModel:
    """The rest pose written where riders look for it."""
    return model.referred(settle(model, design_pose(model)))


def energy(model: RigModel, motion: Motion) -> Array:
    """(N,) J of body, riders with their preloaded springs, and ceiling, written out in world axes."""
    count, n = model.internal, model.cables
    ten = model.physics[layout.INERTIAL : layout.INERTIAL + 10]
    gravity = model.physics[:3]
    block = layout.effects_offset(n)
    R_rest = model.physics[block + place.REFERENCE_ROTATION : block + place.REFERENCE_ROTATION + 9].reshape(
        3, 3
    )
    blocks = model.physics[place.internal_block(n, 0) :].reshape(count, layout.INTERNAL_SIZE)
    about_datum = np.array([[ten[4], ten[5], ten[6]], [ten[5], ten[7], ten[8]], [ten[6], ten[8], ten[9]]])
    total = np.zeros(motion.nodes)
    for k in range(motion.nodes):
        x, R = motion.states[k], motion.R_world_body[k]
        v, w, q, speed = R.T @ x[6:9], x[9:12], x[12 : 12 + count], x[12 + count :]
        total[k] = 0.5 * ten[0] * v @ v + v @ np.cross(w, ten[1:4]) + 0.5 * w @ about_datum @ w
        total[k] -= gravity @ (ten[0] * x[:3] + R @ ten[1:4])
        for j, b in enumerate(blocks):
            omega = 2.0 * np.pi * b[layout.FREQUENCY]
            if b[layout.KIND] == layout.CEILING:
                total[k] += 0.5 / b[layout.COMPLIANCE] * (q[j] ** 2 + (speed[j] / omega) ** 2)
            elif int(b[layout.LEADER]) == j:
                mine = [i for i in range(count) if blocks[i, layout.KIND] == layout.RIDER]
                mine = [i for i in mine if int(blocks[i, layout.LEADER]) == j]
                shift = sum(q[i] * blocks[i, layout.AXIS : layout.AXIS + 3] for i in mine)
                slip = sum(speed[i] * blocks[i, layout.AXIS : layout.AXIS + 3] for i in mine)
                if b[layout.PENDULUM]:
                    arm = np.linalg.norm(gravity) / omega**2
                    s = np.sqrt(arm**2 - q[j] ** 2 - q[j + 1] ** 2)
                    up = np.array([0.0, 0.0, 1.0])
                    shift = shift + up * (arm - s)
                    slip = slip + up * (q[j] * speed[j] + q[j + 1] * speed[j + 1]) / s
                a, m = b[layout.POINT : layout.POINT + 3], b[layout.MASS]
                moved, fixed = v + np.cross(w, a + shift) + slip, v + np.cross(w, a)
                total[k] += 0.5 * m * (moved @ moved - fixed @ fixed) - m * gravity @ R @ shift
                if not b[layout.PENDULUM]:
                    total[k] += m * shift @ (R_rest.T @ gravity)
                    for i in mine:
                        own = 2.0 * np.pi * (blocks[i, layout.FREQUENCY] or b[layout.FREQUENCY])
                        total[k] += 0.5 * m * own**2 * q[i] ** 2
    return total


def rigs() -> list[tuple[str, RigModel, Sample]]:
    out = []
    for name, sample, blocks in (
        ("slosh", thesis_case_14(), rider(80.0, np.array([0.4, 0.2, -0.8]), AXES[:2], 0.8)),
        ("pendulum", thesis_case_14(), pendulum(80.0, np.array([0.4, 0.2, -0.8]), 0.6)),
        ("sprung", trifilar(), rider(40.0, np.array([-0.2, 0.1, -0.6]), AXES[2:], 2.1)),
        ("all ways", thesis_case_14(), on_springs(300.0, np.array([0.3, -0.4, -0.7]), (3.4, 4.1, 2.2))),
        ("ceiling", thesis_case_14(), ceiling(2e-6, AXES[2], 5.0)),
        ("sideways", trifilar(), ceiling(5e-6, np.array([0.6, 0.8, 0.0]), 4.0)),
    ):
        out.append((name, with_rest(sample.model(rods=True)).with_internal(blocks), sample))
    return out


@pytest.mark.parametrize(("model", "sample"), [r[1:] for r in rigs()], ids=[r[0] for r in rigs()])
def test_energy_and_lengths_are_kept(model: RigModel, sample: Sample) -> None:
    start = sample.start.moved(np.zeros(model.states))
    start = start.moved(
        np.concatenate([np.zeros(12), 0.01 * np.ones(model.internal), np.zeros(model.internal)])
    )
    motion = simulate(model, start, Input.none(1001, 0.01), substeps=10)
    assert motion.complete
    total = energy(model, motion)
    swing = np.max(
        total - energy(model, simulate(model, find_rest(model, start).state, Input.none(2, 0.01)))[0]
    )
    assert swing > 1.0
    assert np.max(np.abs(total - total[0])) <= 2e-6 * swing
    if not np.any(model.physics[place.internal_block(model.cables, 0)] == layout.CEILING):
        lengths = cable_lengths(model, motion.states[:, :3], motion.R_world_body)
        assert np.max(np.abs(lengths - unloaded_lengths(model))) <= 1e-9
    # The internal coordinate really moves, and the body feels it
    assert np.max(np.abs(motion.states[:, 12])) > 1e-4


@pytest.mark.parametrize("elastic", [False, True])
def test_every_number_of_internal_coordinates(elastic: bool) -> None:
    sample = random_sample(5, 3)
    model = with_rest(sample.model(axial_stiffness=2e6 if elastic else None, rods=True))
    model = model.with_internal(rider(60.0, np.array([0.3, 0.1, -0.5]), AXES[:2], 0.9, 0.05))
    model = model.with_internal(pendulum(30.0, np.array([0.1, 0.2, -0.4]), 1.4, 0.02))
    model = model.with_internal(rider(0.0, np.array([0.1, -0.3, -0.2]), AXES[2:], 2.0, 0.02))
    model = model.with_internal(ceiling(1e-6, AXES[2], 6.0, 0.03))
    model = model.with_internal(ceiling(2e-6, AXES[2], 8.0, 0.2, hinge=2))
    model = model.with_internal(on_springs(40.0, np.array([-0.2, 0.3, -0.3]), (3.1, 4.2, 2.5)))
    assert model.internal == 10
    start, drive = moving(sample, model, 5), driven(41, 0.01, 5)
    body = [
        layout.INERTIAL,
        layout.INERTIAL + 3,
        layout.cable_offset(1),
        layout.cable_offset(0) + layout.LENGTH,
    ]
    check_physics(model, start, drive, body, 1e-5)
    steps = {layout.MASS: 0.1, layout.POINT: 1e-3, layout.POINT + 2: 1e-3}
    steps |= {layout.FREQUENCY: 1e-4, layout.DAMPING_RATIO: 1e-3}
    entries = {place.internal_block(3, k) + e: h for k in (0, 2, 4) for e, h in steps.items()}
    entries[place.internal_block(3, 8) + layout.FREQUENCY] = 1e-4
    entries[place.internal_block(3, 5) + layout.COMPLIANCE] = 1e-10
    entries[place.internal_block(3, 5) + layout.FREQUENCY] = 1e-3
    entries[place.internal_block(3, 6) + layout.COMPLIANCE] = 1e-10
    exact = simulate(model, start, drive, directions=np.array(list(entries)), substeps=20)
    assert exact.J is not None
    where = slice(layout.OUT_RATE, None)
    for k, (entry, h) in enumerate(entries.items()):
        ends = []
        for sign in (1.0, -1.0):
            physics = model.physics.copy()
            physics[entry] += sign * h
            ends.append(simulate(model.with_physics(physics), start, drive, substeps=20).outputs)
        numeric = (ends[0] - ends[1])[:, where] / (2.0 * h)
        size = np.maximum(np.max(np.abs(numeric)), 1e-9)
        assert np.max(np.abs(exact.J[:, where, k] - numeric)) < 1e-5 * size, entry


def test_start_coordinates_of_internal_motion() -> None:
    _, model, sample = rigs()[3]
    start = sample.start.moved(np.zeros(model.states))
    column = np.zeros((model.states, 2))
    column[12, 0] = column[13, 1] = 1.0
    none = np.zeros(0, dtype=np.int64)
    exact = simulate(model, start, Input.none(41, 0.01), directions=none, start_basis=column, substeps=20)
    assert exact.J is not None
    for k, h in ((0, 1e-5), (1, 1e-4)):
        ends = [
            simulate(model, start.moved(s * h * column[:, k]), Input.none(41, 0.01), substeps=20).outputs
            for s in (1.0, -1.0)
        ]
        numeric = (ends[0] - ends[1]) / (2.0 * h)
        size = np.max(np.abs(numeric), axis=0)[layout.OUT_RATE :]
        error = np.max(np.abs(exact.J[:, layout.OUT_RATE :, k] - numeric[:, layout.OUT_RATE :]), axis=0)
        assert np.all(error < 1e-4 * np.max(size))


@pytest.mark.parametrize(("model", "sample"), [r[1:] for r in rigs()], ids=[r[0] for r in rigs()])
def test_a_body_at_rest_stays(model: RigModel, sample: Sample) -> None:
    rest = find_rest(model, sample.start)
    assert rest.converged
    motion = simulate(model, rest.state, Input.none(201, 0.01))
    assert np.max(np.abs(motion.states - motion.states[0])) < 1e-8
    weight = -model.physics[layout.INERTIAL] * model.physics[2]
    up = np.array([0.0, 0.0, 1.0])
    if model.physics[place.internal_block(model.cables, 0)] == layout.CEILING:
        axis = model.physics[place.internal_block(model.cables, 0) + layout.AXIS :][:3]
        compliance = model.physics[place.internal_block(model.cables, 0) + layout.COMPLIANCE]
        # Cables carry the weight and nothing sideways
        assert rest.state.internal[0] == pytest.approx(-compliance * weight * axis @ up, abs=1e-9)


def test_a_stiffly_held_rider_is_part_of_the_body() -> None:
    sample = thesis_case_14()
    plain = with_rest(sample.model(rods=True))
    held = plain.with_internal(rider(80.0, np.array([0.4, 0.2, -0.8]), AXES, 60.0, 0.5))
    drive = driven(301, 0.01, 3)
    one, other = simulate(plain, sample.start, drive), simulate(held, sample.start, drive)
    loose = plain.with_internal(rider(80.0, np.array([0.4, 0.2, -0.8]), AXES, 1.0, 0.5))
    far = np.max(np.abs(simulate(loose, sample.start, drive).states[:, :3] - one.states[:, :3]))
    assert far > 1e-2
    assert np.max(np.abs(other.states[:, :3] - one.states[:, :3])) < 2e-3 * far


def test_a_massless_rider_and_a_hard_ceiling_move_nothing() -> None:
    sample = thesis_case_14()
    plain = with_rest(sample.model(rods=True))
    idle = plain.with_internal(rider(0.0, np.zeros(3), AXES[:1], 1.0)).with_internal(
        ceiling(0.0, AXES[2], 9.0)
    )
    drive = driven(201, 0.01, 4)
    one, other = simulate(plain, sample.start, drive), simulate(idle, sample.start, drive, substeps=3)
    assert np.max(np.abs(one.outputs - other.outputs)) < 1e-6 * np.max(np.abs(one.outputs))


def test_a_loose_mass_stays_between_its_stops() -> None:
    sample = thesis_case_14()
    blocks = rider(30.0, np.array([0.2, 0.0, -0.7]), AXES[:1], 0.0)
    blocks[0, layout.STOP] = 0.03
    model = with_rest(sample.model(rods=True)).with_internal(blocks)
    motion = simulate(model, sample.start, driven(1001, 0.01, 6))
    travel = motion.states[:, 12]
    assert np.max(np.abs(travel)) > 0.03
    assert np.max(np.abs(travel)) < 0.06


def turning(about: Array, inertia: Array, frequency: float, damping: float = 0.0) -> Array:
    """Blocks behind a rider's, of axes that it turns about. about (t,): of x, y, z; inertia (3, 3) kg m^2."""
    blocks = np.zeros((len(about), layout.INTERNAL_SIZE))
    blocks[:, layout.KIND] = layout.TURNING
    blocks[:, layout.AXIS : layout.AXIS + 3] = AXES[about]
    blocks[:, layout.INERTIA : layout.INERTIA + 3] = inertia[about]
    blocks[:, layout.FREQUENCY], blocks[:, layout.DAMPING_RATIO] = frequency, damping
    return blocks


def test_four_wheels_are_one_part_that_turns() -> None:
    """Each wheel goes up and down by itself: small motions are those of one part that also turns."""
    model = with_rest(thesis_case_14().model(rods=True))
    middle, arm = np.array([0.4, 0.2, -0.8]), np.array([0.5, 0.9, 0.0])
    wheels = model
    for sign in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        at = middle + arm * [*sign, 0.0]
        wheels = wheels.with_internal(rider(10.0, at, AXES[2:], 2.0, 0.1))
    inertia = 40.0 * np.diag([arm[1] ** 2, arm[0] ** 2, 1.0])
    one = np.concatenate(
        [rider(40.0, middle, AXES[2:], 2.0, 0.1), turning(np.array([0, 1]), inertia, 2.0, 0.1)]
    )
    drive = driven(61, 0.01, 5)
    small = replace(drive, force=0.1 * drive.force)
    outputs = []
    for m in (wheels, model.with_internal(one), model.with_internal(one[:1])):
        rest = find_rest(m, design_pose(m)).state
        outputs.append(simulate(m, rest, small).outputs[:, layout.OUT_RATE :])
    apart = [float(np.max(np.abs(o - outputs[0]))) for o in outputs[1:]]
    assert apart[0] < 1e-3 * apart[1]


def test_a_turning_part_keeps_its_energy() -> None:
    """A free turn in all directions of a part with products of inertia, of large and of small swings."""
    inertia = np.array([[20.0, 3.0, -2.0], [3.0, 30.0, 4.0], [-2.0, 4.0, 36.0]])
    model = with_rest(thesis_case_14().model(rods=True))
    model = model.with_internal(
        np.concatenate(
            [
                on_springs(100.0, np.array([0.3, -0.4, -0.7]), (3.4, 4.1, 2.2)),
                turning(np.arange(3), inertia, 3.0),
            ]
        )
    )
    lost = []
    for size in (0.02, 0.01):
        start = find_rest(model, design_pose(model)).state
        start = start.moved(np.concatenate([np.zeros(15), size * np.array([1.0, -0.7, 0.5]), np.zeros(6)]))
        motion = simulate(model, start, Input.none(61, 0.01), substeps=4)
        q, speed, w = motion.states[:, 15:18], motion.states[:, 21:24], motion.states[:, 9:12]
        total = energy(model, motion)
        spring = (2.0 * np.pi * 3.0) ** 2 * np.diag(inertia)
        for k in range(motion.nodes):
            turn = np.cross(q[k], np.eye(3)).T  # [q] as it acts on columns
            P = inertia + turn @ inertia - inertia @ turn
            g = w[k] + speed[k] + 0.5 * np.cross(q[k], speed[k])
            total[k] += 0.5 * g @ P @ g - 0.5 * w[k] @ inertia @ w[k] + 0.5 * spring @ q[k] ** 2
        lost.append(float(np.max(np.abs(total - total[0]))) / (0.5 * spring @ q[0] ** 2))
    # What is left out is of third order in the turn
    assert lost[0] < 1e-3
    assert lost[1] < 0.35 * lost[0] + 1e-6
