"""What each device reads, against its definition, and its derivatives against central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from test_model_rigs import moving, random_sample

from rig_identification.model import layout, sensors
from rig_identification.model.motion import Input, Motion, simulate
from rig_identification.model.so3 import inverse_right_jacobian, left_jacobian, skew

Array = NDArray[np.float64]
SEEDS = st.integers(0, 10_000)
ROTATION = slice(layout.OUT_ROTATION, layout.OUT_ROTATION + 3)


def swing(seed: int, nodes: int = 21, step: float = 0.05) -> Motion:
    sample = random_sample(seed, 3)
    model = sample.model(rods=True)
    return simulate(model, moving(sample, model, seed), Input.none(nodes, step))


def slope(function: Callable[[Array], Array], at: Array, h: float = 1e-3) -> Array:
    """(..., q) derivative of ``function`` in the q entries of ``at`` by Richardson extrapolation."""
    columns = []
    for i in range(at.size):
        e = np.eye(at.size)[i]

        def central(s: float, e: Array = e) -> Array:
            return (function(at + s * e) - function(at - s * e)) / (2.0 * s)

        columns.append((4.0 * central(h / 2.0) - central(h)) / 3.0)
    return np.stack(columns, axis=-1)


def check(read: Callable[[Array, Array, Array], sensors.Reading], motion: Motion, device: Array) -> None:
    """Derivatives in raw outputs, in the pose (column OUT_ROTATION) and in the device's numbers."""
    raw, R = motion.outputs, motion.R_world_body
    reading = read(raw, R, device)
    assert np.all(np.isfinite(reading.values))
    numeric = slope(lambda d: read(raw, R, d).values, device)
    np.testing.assert_allclose(reading.in_device, numeric, atol=1e-8 * max(1.0, np.max(np.abs(numeric))))
    for column in range(raw.shape[1]):
        if ROTATION.start <= column < ROTATION.stop:
            axis = np.eye(3)[column - ROTATION.start]

            def moved(s: Array, axis: Array = axis) -> Array:
                # Gravity's components are raw outputs of their own: here only the pose turns
                turn = Rotation.from_rotvec(s[0] * axis).as_matrix()
                return read(raw, R @ turn, device).values

        else:
            unit = np.eye(raw.shape[1])[column]

            def moved(s: Array, unit: Array = unit) -> Array:
                return read(raw + s[0] * unit, R, device).values

        numeric = slope(moved, np.zeros(1))[..., 0]
        np.testing.assert_allclose(
            reading.in_raw[:, :, column], numeric, atol=1e-8 * max(1.0, np.max(np.abs(numeric)))
        )


@given(SEEDS)
@settings(max_examples=5, deadline=None, derandomize=True)
def test_load_cell(seed: int) -> None:
    motion = swing(seed)
    check(
        lambda raw, R, d: sensors.load_cell(raw, 1, d),
        motion,
        np.array([0.01, 4.0, 2e-6, 0.0, 30.0, 0.02, 0.5, -0.03]),
    )
    reading = sensors.load_cell(motion.outputs, 2, np.array([0.02, -3.0, 1e-6, 0.0, 0.0, 0.0, 0.04, 0.7]))
    other, tension = motion.outputs[:, layout.OUT_TENSION + 1 :].T
    np.testing.assert_allclose(reading.values[:, 0], 1.02 * tension - 3.0 + 1e-6 * tension**2 + 0.04 * other)


@given(SEEDS)
@settings(max_examples=5, deadline=None, derandomize=True)
def test_imu_derivatives(seed: int) -> None:
    rng = np.random.default_rng(seed)
    position, turn = rng.normal(size=3), Rotation.random(random_state=seed).as_matrix()
    device = 0.05 * rng.normal(size=sensors.IMU_SIZE)
    check(lambda raw, R, d: sensors.imu(raw, position, turn, d), swing(seed), device)


def test_imu_feels_the_acceleration_of_its_own_origin() -> None:
    step = 0.0005
    motion = swing(3, 2001, step)
    position, turn = np.array([0.7, -0.4, 0.3]), Rotation.from_rotvec([0.2, 0.5, -1.0])
    reading = sensors.imu(motion.outputs, position, turn.as_matrix(), np.zeros(sensors.IMU_SIZE))
    path = motion.states[:, :3] + motion.R_world_body @ position
    acceleration = np.gradient(np.gradient(path, step, axis=0, edge_order=2), step, axis=0, edge_order=2)
    felt = np.einsum("nji,nj->ni", motion.R_world_body, acceleration + np.array([0.0, 0.0, 9.80665]))
    np.testing.assert_allclose(reading.values[5:-5, 3:], turn.inv().apply(felt)[5:-5], atol=1e-4)
    np.testing.assert_allclose(reading.values[:, :3], turn.inv().apply(motion.outputs[:, 6:9]), atol=1e-12)


@given(SEEDS)
@settings(max_examples=5, deadline=None, derandomize=True)
def test_inclinometer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(0.3 * rng.normal(size=3)).as_matrix()
    motion, device = swing(seed), 0.02 * rng.normal(size=sensors.INCLINOMETER_SIZE)
    check(lambda raw, R, d: sensors.inclinometer(raw, turn, d), motion, device)
    axes = motion.R_world_body @ Rotation.from_rotvec(device[:3]).as_matrix() @ turn
    above = np.arctan2(axes[:, 2, :2], np.hypot(axes[:, 0, :2], axes[:, 1, :2]))
    np.testing.assert_allclose(
        sensors.inclinometer(motion.outputs, turn, device).values - device[3:], above, atol=1e-12
    )


@given(SEEDS)
@settings(max_examples=5, deadline=None, derandomize=True)
def test_mocap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turns = Rotation.random(2, random_state=seed).as_matrix()
    mount = sensors.MocapMount(rng.normal(size=3), turns[0], rng.normal(size=3), turns[1])
    motion, device = swing(seed), 0.1 * rng.normal(size=sensors.MOCAP_SIZE)
    R = motion.R_world_body
    mean = Rotation.from_matrix(turns[1] @ R @ turns[0]).mean().as_matrix()
    check(lambda raw, R, d: sensors.mocap(raw, R, mount, mean, d), motion, device)
    reading = sensors.mocap(motion.outputs, R, mount, mean, np.zeros(sensors.MOCAP_SIZE))
    marker = motion.states[:, :3] + R @ mount.marker_position
    np.testing.assert_allclose(reading.values[:, :3], marker @ turns[1].T + mount.world_position, atol=1e-12)
    back = mean @ Rotation.from_rotvec(reading.values[:, 3:]).as_matrix()
    np.testing.assert_allclose(back, turns[1] @ R @ turns[0], atol=1e-12)


@pytest.mark.parametrize("size", [0.0, 1e-6, 5e-5, 2e-4, 0.3, 2.5])
def test_jacobians_of_the_rotation_group(size: float) -> None:
    phi = size * np.array([2.0, -1.0, 2.0]) / 3.0
    d = 1e-5 * np.array([0.3, 0.5, -0.8])

    def log(R: Rotation) -> Array:
        return np.asarray(R.as_rotvec())

    base = Rotation.from_rotvec(phi)
    left = log(Rotation.from_rotvec(phi + d) * base.inv()) - log(Rotation.from_rotvec(phi - d) * base.inv())
    np.testing.assert_allclose(left_jacobian(phi) @ d, left / 2.0, atol=1e-13)
    right = log(base * Rotation.from_rotvec(d)) - log(base * Rotation.from_rotvec(-d))
    np.testing.assert_allclose(inverse_right_jacobian(phi[None])[0] @ d, right / 2.0, atol=1e-13)
    np.testing.assert_allclose(skew(phi) @ d, np.cross(phi, d), atol=1e-18)


def test_a_cell_with_play_reads_behind_the_load_on_either_branch() -> None:
    """A swing that turns by more than twice the play goes round a loop of the area 4 h (A - play)."""
    time, amount, play, size = np.linspace(0.0, 3.0, 30001), 2.0, 25.0, 100.0
    raw = np.zeros((time.size, layout.OUT_TENSION + 1))
    raw[:, layout.OUT_TENSION] = load = 1000.0 + size * np.sin(2.0 * np.pi * time)
    device = np.array([0.0, 0.0, 0.0, amount, play, 0.0])
    reading = sensors.load_cell(raw, 0, device)
    behind = reading.values[:, 0] - load
    assert np.max(np.abs(behind)) == pytest.approx(amount)
    loop = time > 2.0
    area = np.trapezoid(behind[loop], load[loop])
    assert area == pytest.approx(-4.0 * amount * (size - play), rel=1e-3)
    numeric = slope(lambda d: sensors.load_cell(raw, 0, d).values, device)
    # But where a branch is reached within the step of the difference
    off = np.abs(reading.in_device - numeric)[:, 0, [3, 4]]
    assert np.mean(np.max(off, axis=1) > 1e-6) < 1e-3
    # What has no play has no branches
    none = sensors.load_cell(raw, 0, np.array([0.0, 0.0, 0.0, amount, 0.0, 0.0]))
    np.testing.assert_array_equal(none.values[:, 0], load)


@pytest.mark.parametrize("settling", [0.0, 1e-6, 0.3, -0.05])
def test_drift(settling: float) -> None:
    """The zero, and the gain of what is read; each derivative as differences have it."""
    time, device = np.linspace(0.0, 40.0, 9), np.array([0.5, settling, 0.0, -0.2, 0.1, 2e-3])
    values = sensors.drift(time, device).zero
    fine = np.linspace(0.0, 40.0, 40001)
    rate = 0.5 * np.exp(-settling * fine)
    moved = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(fine))])
    np.testing.assert_allclose(values[:, 0], np.interp(time, fine, moved), rtol=1e-6, atol=1e-9)
    read = np.stack([np.cos(time), 100.0 + np.sin(time)], axis=1)
    nothing = sensors.Reading(read, np.ones((9, 2, 3)), lambda: np.ones((9, 2, 1)))
    reading = sensors.drifting(nothing, time, device)
    shape = (1.0 - np.exp(-0.1 * time)) / 0.1
    np.testing.assert_allclose(reading.values[:, 1], read[:, 1] * (1.0 + 2e-3 * shape) - 0.2 * shape)
    np.testing.assert_allclose(reading.in_raw[:, 1, 0], 1.0 + 2e-3 * shape)
    np.testing.assert_allclose(reading.in_device[:, 1, 0], 1.0 + 2e-3 * shape)
    numeric = slope(lambda d: sensors.drifting(nothing, time, d).values, device)
    np.testing.assert_allclose(reading.in_device[:, :, 1:], numeric, rtol=1e-5, atol=1e-4)
