"""Axes that point elsewhere than described: permuted, mirrored, without gravity; quaternions w first."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from bench.first_day.faults.base import (
    IMU_FORCE,
    IMU_RATE,
    Array,
    Case,
    Injector,
    devices,
    on_values,
    resting_mean,
    through,
)
from rig_identification.raw import RawSession

#: Signed permutations of an IMU's axes tried in each session, right-handed and left-handed ones.
TRIED = 6


def signed_permutations(size: int) -> list[Array]:
    """Every signed permutation matrix but the identity."""
    found = []
    for order in itertools.permutations(range(size)):
        for signs in itertools.product((1.0, -1.0), repeat=size):
            matrix = np.zeros((size, size))
            matrix[range(size), order] = signs
            if not np.array_equal(matrix, np.eye(size)):
                found.append(matrix)
    return found


def label(matrix: Array) -> str:
    """What the device's axes carry, as -y+x+z."""
    out = ""
    for row in matrix:
        k = int(np.argmax(np.abs(row)))
        out += "+-"[int(row[k] < 0.0)] + "xyz"[k]
    return out


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of axes that the session's devices can have."""
    held = devices(raw)
    if "imu" in held:
        yield from _imu(raw)
    if "inclinometer" in held:
        for matrix in signed_permutations(2):
            inject = on_values(("inclinometer",), through(matrix))
            yield Case(f"axes/inclinometer/{label(matrix)}", "axes", ("inclinometer",), inject)
    if "mocap" in held:
        yield from _mocap()


def _imu(raw: RawSession) -> Iterator[Case]:
    everything = signed_permutations(3)
    # The same spread in every run, another one for another session
    start = sum(raw.name.encode()) % 4
    for proper in (True, False):
        ones = [m for m in everything if (np.linalg.det(m) > 0.0) == proper]
        for matrix in ones[start :: len(ones) // TRIED][:TRIED]:
            yield _turned("both", matrix, slice(0, 6))
    tilted = next(m for m in everything if label(m) == "-y+x+z")
    yield _turned("accelerometer", tilted, IMU_FORCE)
    yield _turned("gyroscope", tilted, IMU_RATE)
    yield _turned("gravity_sign", -np.eye(3), IMU_FORCE)
    yield _turned("gravity_sign", np.diag([1.0, 1.0, -1.0]), IMU_FORCE)
    for axis in range(3):
        signs = np.ones(3)
        signs[axis] = -1.0
        yield _turned("gyroscope_sign", np.diag(signs), IMU_RATE)
    yield _turned("gyroscope_sign", -np.eye(3), IMU_RATE)
    yield Case("axes/imu/gravity_removed/by_attitude", "axes", ("imu",), _gravity_by_attitude)
    yield Case("axes/imu/gravity_removed/by_rest", "axes", ("imu",), _gravity_by_rest)


def _turned(what: str, matrix: Array, columns: slice) -> Case:
    def law(values: Array) -> Array:
        triples = values.reshape(len(values), -1, 3)
        return np.asarray(triples @ matrix.T).reshape(values.shape)

    return Case(f"axes/imu/{what}/{label(matrix)}", "axes", ("imu",), on_values(("imu",), law, columns))


def _gravity_by_attitude(raw: RawSession, rng: np.random.Generator) -> RawSession:
    """Linear acceleration of a unit with attitude: specific force less gravity in its momentary axes."""
    assert raw.rig.imu is not None
    mount = Rotation.from_quat(raw.rig.imu.orientation)
    up = np.array([0.0, 0.0, raw.rig.gravity])
    recordings = []
    for recording in raw.recordings:
        imu, truth = recording.channel("imu"), recording.channel("ground_truth")
        if imu is not None and truth is not None:
            columns = [np.interp(imu.stamp_ns, truth.stamp_ns, q) for q in truth.values[:, 3:7].T]
            attitude = Rotation.from_quat(np.stack(columns, axis=1))
            gravity = mount.inv().apply(attitude.inv().apply(up))
            values = imu.values.copy()
            values[:, IMU_FORCE] -= gravity
            recording = recording.with_channels(replace(imu, values=values))
        recordings.append(recording)
    return replace(raw, recordings=tuple(recordings))


def _gravity_by_rest(raw: RawSession, rng: np.random.Generator) -> RawSession:
    """A driver that takes its reading at rest as zero."""
    rest = resting_mean(raw, "imu")[IMU_FORCE]
    return on_values(("imu",), lambda v: v - rest, IMU_FORCE)(raw, rng)


def _mocap() -> Iterator[Case]:
    place, turn = slice(0, 3), slice(3, 7)

    def case(name: str, inject: Injector, untellable: str = "") -> Case:
        return Case(f"axes/mocap/{name}", "axes", ("mocap",), inject, untellable=untellable)

    order = on_values(("mocap",), lambda q: q[:, [3, 0, 1, 2]], turn)
    yield case("quaternion_w_first", order)
    inverse = on_values(("mocap",), lambda q: q * [-1.0, -1.0, -1.0, 1.0], turn)
    yield case("quaternion_of_world_in_body", inverse)
    # A bridge turns positions from y up to z up and forgets the orientations, or swaps y and z outright
    yield case("position_y_up", on_values(("mocap",), through(_Y_UP), place))
    yield case("position_y_z_swapped", on_values(("mocap",), lambda p: p[:, [0, 2, 1]], place))
    yield case("orientation_y_up", _rotated(_Y_UP, positions=False))
    for axis in range(3):
        signs = np.ones(3)
        signs[axis] = -1.0
        mirror = np.diag(signs)
        yield case(f"mirrored_{'xyz'[axis]}", _mirrored(mirror))
        yield case(f"position_mirrored_{'xyz'[axis]}", on_values(("mocap",), through(mirror), place))
    yield case(
        "whole_frame_y_up",
        _rotated(_Y_UP, positions=True),
        "a tracker frame may be turned in the room by any right-handed turn: it is estimated",
    )


#: z up to y up.
_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def _rotated(matrix: Array, *, positions: bool) -> Injector:
    turn = Rotation.from_matrix(matrix)

    def law(values: Array) -> Array:
        out = values.copy()
        if positions:
            out[:, :3] = turn.apply(values[:, :3])
        out[:, 3:7] = (turn * Rotation.from_quat(values[:, 3:7])).as_quat()
        return np.asarray(out)

    return on_values(("mocap",), law)


def _mirrored(mirror: Array) -> Injector:
    """A left-handed tracker frame: points are mirrored, and the turn is that which a mirror shows."""

    def law(values: Array) -> Array:
        out = values.copy()
        out[:, :3] = values[:, :3] @ mirror.T
        matrices = mirror @ Rotation.from_quat(values[:, 3:7]).as_matrix() @ mirror
        out[:, 3:7] = Rotation.from_matrix(matrices).as_quat()
        return np.asarray(out)

    return on_values(("mocap",), law)
