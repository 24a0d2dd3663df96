"""What each device reads, given the body's motion: pure functions with their exact derivatives.

Every function takes the raw outputs of motion.py (``raw`` (N, 18 + n)) and the device's
own numbers, and returns a :class:`Reading`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model import layout
from rig_identification.model.so3 import inverse_right_jacobian, left_jacobian, skew

Array = NDArray[np.float64]

RATE = slice(layout.OUT_RATE, layout.OUT_RATE + 3)
SPECIFIC_FORCE = slice(layout.OUT_SPECIFIC_FORCE, layout.OUT_SPECIFIC_FORCE + 3)
ANGULAR_ACCELERATION = slice(layout.OUT_ANGULAR_ACCELERATION, layout.OUT_ANGULAR_ACCELERATION + 3)
ROTATION = slice(layout.OUT_ROTATION, layout.OUT_ROTATION + 3)
POSITION = slice(layout.OUT_POSITION, layout.OUT_POSITION + 3)
GRAVITY = slice(layout.OUT_GRAVITY, layout.OUT_GRAVITY + 3)


@dataclass(frozen=True)
class Reading:
    """Values (N, w), derivatives in the raw outputs (N, w, 18 + n) and in the device's numbers (N, w, q).

    The last are worked out where they are asked for: a fit of a start alone, of which a search makes as many
    as of everything, asks for none.
    """

    values: Array
    in_raw: Array
    derive: Callable[[], Array]  # in_device

    @cached_property
    def in_device(self) -> Array:
        """(N, w, q) derivatives in the device's numbers."""
        return self.derive()


def _mixed(pure: Reading, shares: Array) -> Reading:
    """A device whose axes feel each other: each reads a share of what the others read beside its own.

    shares (w w,): share of axis j in axis i at i w + j; of an axis in itself there is none, which is its
    scale. The derivatives in the shares come after the device's other numbers.
    """
    nodes, width = pure.values.shape
    felt = shares.reshape(width, width) * (1.0 - np.eye(width))
    own = pure
    if np.any(felt):
        mix = np.eye(width) + felt
        own = Reading(pure.values @ mix.T, mix @ pure.in_raw, lambda: mix @ pure.in_device)

    def in_device() -> Array:
        numbers = own.in_device.shape[2]
        out = np.zeros((nodes, width, numbers + width**2))
        out[:, :, :numbers] = own.in_device
        for i in range(width):
            first = numbers + width * i
            out[:, i, first : first + width] = pure.values
            out[:, i, first + i] = 0.0
        return out

    return Reading(own.values, own.in_raw, in_device)


#: drift, of each axis: rate of its zero, unit/s, how fast it settles, 1/s, and rate of its gain, 1/s
DRIFT_SIZE, DRIFT_GAIN = 3, 2
#: Below this change over the time asked for a drift is as good as a straight line.
STRAIGHT = 1e-4


def _drift_shapes(time: Array, k: float) -> tuple[Array, Array]:
    """(N,) (1 - exp(-k t)) / k and its derivative in k; t and -t^2/2 where k is next to nothing."""
    x = k * time
    straight = np.abs(x) < STRAIGHT
    safe = np.where(straight, 1.0, x)
    fading = np.exp(-x)
    shape = time * np.where(straight, 1.0 - 0.5 * x, (1.0 - fading) / safe)
    return shape, time**2 * np.where(straight, x / 3.0 - 0.5, (fading * (1.0 + x) - 1.0) / safe**2)


class Drift(NamedTuple):
    """What a device's axes do with time: (N, w) each."""

    zero: Array  # what is read beside what is measured
    gain: Array  # share of what is measured that is read besides
    shape: Array  # of a unit rate, of either
    bend: Array  # its derivative in how fast it settles

    def read(self, values: Array) -> Array:
        """(N, w) what is read of ``values`` (N, w)."""
        return np.asarray(values * (1.0 + self.gain) + self.zero)


def drift(time: Array, device: Array) -> Drift:
    """How the zeros and gains of a device's axes have moved.

    time (N,): s after a recording's start. device (3 w,): of each axis the rate r of its zero at first,
    unit/s, how fast k it settles, 1/s, and the rate of its gain, 1/s. A part that warms up towards its
    surroundings moves by r (1 - exp(-k t)) / k; where it does not settle within the recording, by r t.
    """
    rates, settling, gains = device.reshape(-1, DRIFT_SIZE).T
    shapes = [_drift_shapes(time, k) for k in settling]
    shape, bend = np.stack([s for s, _ in shapes], axis=1), np.stack([b for _, b in shapes], axis=1)
    return Drift(rates * shape, gains * shape, shape, bend)


def drifting(reading: Reading, time: Array, device: Array) -> Reading:
    """A reading whose zeros and gains move with time (:func:`drift`); their mean where it has a single row.

    The derivatives in ``device`` come after the device's other numbers.
    """
    rates, _, gains = device.reshape(-1, DRIFT_SIZE).T

    def moved() -> Drift:
        whole = drift(time, device)
        if reading.values.shape[0] > 1:
            return whole
        return Drift(*(np.mean(part, axis=0, keepdims=True) for part in whole))

    def in_device() -> Array:
        there, own = moved(), np.zeros((*reading.values.shape, device.size))
        for axis, values in enumerate(reading.values.T):
            numbers = own[:, axis, DRIFT_SIZE * axis : DRIFT_SIZE * (axis + 1)]
            numbers[:, 0] = there.shape[:, axis]
            numbers[:, 1] = (rates[axis] + gains[axis] * values) * there.bend[:, axis]
            numbers[:, DRIFT_GAIN] = there.shape[:, axis] * values
        return np.concatenate([reading.in_device * (1.0 + there.gain)[:, :, None], own], axis=2)

    if not (np.any(rates) or np.any(gains)):
        # Of the many devices that do not drift only derivatives are ever asked for
        return Reading(reading.values, reading.in_raw, in_device)
    here = moved()
    return Reading(here.read(reading.values), reading.in_raw * (1.0 + here.gain)[:, :, None], in_device)


#: load_cell: gain error 1, zero N, curve 1/N, hysteresis N, play N; then the share of each cable's tension
#: that it feels
LOAD_CELL_CURVE, LOAD_CELL_HYSTERESIS, LOAD_CELL_PLAY, LOAD_CELL_OWN = 2, 3, 4, 5


def load_cell_size(cables: int) -> int:
    """How many numbers a load cell has beside so many ``cables``."""
    return LOAD_CELL_OWN + cables


@njit(cache=True)
def branch(load, play):  # type: ignore[no-untyped-def]
    """(N,) on which branch a device with play is, from -1 to 1, and its derivative in the play, per unit.

    load (N,): what it bears over time. play: by how much the load has to turn for the other branch, half of
    it; 0: it has none, and there are no branches. The stop operator (Krasnosel'skii and Pokrovskii, "Systems
    with Hysteresis", 1989), between its branches at first.
    """
    values, slopes = np.zeros(load.size), np.zeros(load.size)
    if play <= 0.0:
        return values, slopes
    for k in range(1, load.size):
        step = (load[k] - load[k - 1]) / play
        moved = values[k - 1] + step
        values[k] = min(1.0, max(-1.0, moved))
        if values[k] == moved:
            slopes[k] = slopes[k - 1] - step / play
    return values, slopes


def load_cell(raw: Array, cable: int, device: Array) -> Reading:
    """Tension (1 + gain) T + zero + curve T^2 - hysteresis s + sum of share_j T_j of one cable, N.

    device (5 + n,): gain error, zero, curve, hysteresis, play, and shares of all cables, of which its own
    says nothing. s (:func:`branch`): -1 where the load falls, 1 where it rises, and between them for a play
    after it turned. Its slope in the tension is left out of the derivatives: it is a small share of one.
    curve: the first term of a bridge or an amplifier that is not straight. share: of what leaks over from
    another cell's channel, or of the load that reaches this one beside the cable.
    """
    nodes, width = raw.shape
    tensions = raw[:, layout.OUT_TENSION :]
    tension = tensions[:, cable]
    shares = device[LOAD_CELL_OWN:].copy()
    shares[cable] = 0.0
    in_raw = np.zeros((nodes, 1, width))
    in_raw[:, 0, layout.OUT_TENSION :] = shares
    in_raw[:, 0, layout.OUT_TENSION + cable] = 1.0 + device[0] + 2.0 * device[2] * tension

    lag, in_play = branch(np.ascontiguousarray(tension), float(device[LOAD_CELL_PLAY]))

    def in_device() -> Array:
        out = np.empty((nodes, 1, device.size))
        out[:, 0, 0] = tension
        out[:, 0, 1] = 1.0
        out[:, 0, LOAD_CELL_CURVE] = tension**2
        out[:, 0, LOAD_CELL_HYSTERESIS] = -lag
        out[:, 0, LOAD_CELL_PLAY] = -device[LOAD_CELL_HYSTERESIS] * in_play
        out[:, 0, LOAD_CELL_OWN:] = tensions
        out[:, 0, LOAD_CELL_OWN + cable] = 0.0
        return out

    values = (1.0 + device[0] + device[2] * tension) * tension + device[1] + tensions @ shares
    values = values - device[LOAD_CELL_HYSTERESIS] * lag
    return Reading(values[:, None], in_raw, in_device)


#: imu: position error 3, rotation error 3, gyroscope bias 3 and scale 3, accelerometer bias 3 and scale 3;
#: then the share of each of its six axes that each of them feels
IMU_OWN = 18
IMU_SIZE = IMU_OWN + 36


def imu(raw: Array, position: Array, orientation: Array, device: Array) -> Reading:
    """Angular rate and specific force (N, 6) in the IMU frame, at its origin.

    position (3,) m and orientation (3, 3): as described. device (54,): position error m,
    rotation vector of the frame against its description (rad, body axes), gyroscope bias
    rad/s, gyroscope scale error, accelerometer bias m/s^2, accelerometer scale error, and what its axes
    feel of each other (:func:`_mixed`): a gyroscope of specific force, rad/s per m/s^2, for one.
    Specific force at the lever arm r: f + alpha x r + w x (w x r).
    """
    r = position + device[0:3]
    turn = Rotation.from_rotvec(device[3:6]).as_matrix() @ orientation
    to_imu = turn.T
    gyro_scale, accel_scale = np.diag(1.0 + device[9:12]), np.diag(1.0 + device[15:18])
    w, f, alpha = raw[:, RATE], raw[:, SPECIFIC_FORCE], raw[:, ANGULAR_ACCELERATION]
    at_imu = f + np.cross(alpha, r) + np.cross(w, np.cross(w, r))
    nodes, width = raw.shape
    values = np.concatenate(
        [w @ (gyro_scale @ to_imu).T + device[6:9], at_imu @ (accel_scale @ to_imu).T + device[12:15]], axis=1
    )
    C_gyro, C_accel = gyro_scale @ to_imu, accel_scale @ to_imu
    in_raw = np.zeros((nodes, 6, width))
    in_raw[:, :3, RATE] = C_gyro
    in_raw[:, 3:, SPECIFIC_FORCE] = C_accel
    in_raw[:, 3:, ANGULAR_ACCELERATION] = -C_accel @ skew(r)
    # d(w x (w x r)) = -(skew(w x r) + skew(w) skew(r)) dw
    in_raw[:, 3:, RATE] = -C_accel @ (skew(np.cross(w, r)) + skew(w) @ skew(r))

    def in_device() -> Array:
        out = np.zeros((nodes, 6, IMU_OWN))
        out[:, 3:, 0:3] = C_accel @ (skew(alpha) + skew(w) @ skew(w))
        J = left_jacobian(device[3:6])
        out[:, :3, 3:6] = C_gyro @ skew(w) @ J
        out[:, 3:, 3:6] = C_accel @ skew(at_imu) @ J
        pure_gyro, pure_accel = w @ to_imu.T, at_imu @ to_imu.T
        for i in range(3):
            out[:, i, 6 + i] = 1.0
            out[:, i, 9 + i] = pure_gyro[:, i]
            out[:, 3 + i, 12 + i] = 1.0
            out[:, 3 + i, 15 + i] = pure_accel[:, i]
        return out

    return _mixed(Reading(values, in_raw, in_device), device[IMU_OWN:])


#: inclinometer: rotation error 3, zero error of x and y
INCLINOMETER_SIZE = 5


def inclinometer(raw: Array, orientation: Array, device: Array) -> Reading:
    """Angles (N, 2) of the inclinometer's x and y axis above the horizontal plane, rad.

    orientation (3, 3): as described. device (5,): rotation vector against it, rad, body axes, and
    zero error of each axis, rad.
    """
    turn = Rotation.from_rotvec(device[:3]).as_matrix() @ orientation
    gravity = raw[:, GRAVITY]
    size = np.linalg.norm(gravity, axis=1, keepdims=True)
    up = -gravity / size
    sine = np.clip(up @ turn[:, :2], -1.0, 1.0)
    nodes, width = raw.shape
    slope = 1.0 / np.sqrt(np.maximum(1.0 - sine**2, 1e-12))
    in_up = slope[:, :, None] * turn[:, :2].T[None]
    in_raw = np.zeros((nodes, 2, width))
    in_raw[:, :, GRAVITY] = (
        -(in_up - np.einsum("nij,nj->ni", in_up, up)[:, :, None] * up[:, None, :]) / size[:, :, None]
    )

    def in_device() -> Array:
        # d(axis) = d x axis: up . (d x axis) = d . (axis x up)
        turned = np.cross(turn[:, :2].T[None], up[:, None, :])
        out = np.zeros((nodes, 2, INCLINOMETER_SIZE))
        out[:, :, :3] = slope[:, :, None] * turned @ left_jacobian(device[:3])
        out[:, :, 3:] = np.eye(2)
        return out

    return Reading(np.arcsin(sine) + device[3:5], in_raw, in_device)


#: mocap: marker position 3 and rotation 3 in body, tracker position 3 and rotation 3 in world
MOCAP_SIZE = 12


@dataclass(frozen=True)
class MocapMount:
    """Where the marker frame sits on the body, and the world in the tracker's frame (current belief)."""

    marker_position: Array  # (3,) m, body
    R_body_marker: Array  # (3, 3)
    world_position: Array  # (3,) m, origin of world in the tracker frame
    R_tracker_world: Array  # (3, 3)

    def off_by(self, errors: Array) -> MocapMount:
        """The mount with errors (12,): marker position m (body), marker rotation (rad, body axes, left),
        world position m (tracker), world rotation (rad, tracker axes, left).
        """
        return MocapMount(
            self.marker_position + errors[0:3],
            Rotation.from_rotvec(errors[3:6]).as_matrix() @ self.R_body_marker,
            self.world_position + errors[6:9],
            Rotation.from_rotvec(errors[9:12]).as_matrix() @ self.R_tracker_world,
        )


def mocap(
    raw: Array, R_world_body: Array, mount: MocapMount, R_tracker_mean: Array, device: Array
) -> Reading:
    """Pose (N, 6) of the marker frame in the tracker frame: position m, rotation vector about the mean rad.

    R_tracker_mean (3, 3): orientation about which rotation vectors are taken, so that they
    stay short. device (12,): errors of the mount (:meth:`MocapMount.off_by`).
    """
    really = mount.off_by(device)
    r, R_bm, shift, R_tw = (
        really.marker_position,
        really.R_body_marker,
        really.world_position,
        really.R_tracker_world,
    )
    marker_world = raw[:, POSITION] + R_world_body @ r
    position = marker_world @ R_tw.T + shift
    R_tb = R_tw @ R_world_body
    about_mean = R_tracker_mean.T @ R_tb @ R_bm
    turn = Rotation.from_matrix(about_mean).as_rotvec()
    J_inverse = inverse_right_jacobian(turn)
    nodes, width = raw.shape
    in_raw = np.zeros((nodes, 6, width))
    in_raw[:, :3, POSITION] = R_tw
    in_raw[:, :3, ROTATION] = -R_tb @ skew(r)
    in_raw[:, 3:, ROTATION] = J_inverse @ R_bm.T

    def in_device() -> Array:
        out = np.zeros((nodes, 6, MOCAP_SIZE))
        out[:, :3, 0:3] = R_tb
        out[:, 3:, 3:6] = J_inverse @ R_bm.T @ left_jacobian(device[3:6])
        out[:, :3, 6:9] = np.eye(3)
        J_tracker = left_jacobian(device[9:12])
        out[:, :3, 9:12] = -skew(position - shift) @ J_tracker
        out[:, 3:, 9:12] = J_inverse @ (R_tb @ R_bm).transpose(0, 2, 1) @ J_tracker
        return out

    return Reading(np.concatenate([position, turn], axis=1), in_raw, in_device)
