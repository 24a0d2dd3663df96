"""Readings of one run as functions of the body's motion: what each device misses, and its slopes.

    length of cable i     |c_i - x - R b_i|                         constant
    angular rate          R_bi^T w
    specific force        R_bi^T (R^T (x'' + g z) + w' x r + w x (w x r))
    angle of an axis a    asin(a . R^T z)
    tracked place         x + R m                                   in a frame of the tracker's own
    tracked turn          q                                         from the run's mean

The tracker's frame is any proper rotation of the room's; where the marker's mount is described, the mean of
its attitudes tells it. A constant of each reading is free.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.rest_model import BIAS, DOUBT, LENGTH, TILT
from rig_identification.check.consistency.spline import Block
from rig_identification.check.consistency.trajectory import Trajectory, cross, rotation
from rig_identification.model.so3 import skew
from rig_identification.rig import Mount, Rig

Array = NDArray[np.float64]
#: Slopes by pose, velocity and acceleration.
Slopes = tuple[Array | None, Array | None, Array | None]

#: Share of a reading's variation that ordinary errors and left-out physics leave unexplained, and share of
#: the whole device's that axes turned by a few hundredths of a radian bring over from the others.
ORDINARY, ACROSS = 0.15, 0.05
#: Spread of a reading that never changes, so that its logarithm exists.
TINY = 1e-9
#: Smallest variation that tells anything: rad/s, m/s^2, rad, m, m, rad.
FLOOR = {
    "gyroscope": 0.002, "accelerometer": 0.03, "inclinometer": 0.0005, "length": 0.003,
    "mocap_place": 0.002, "mocap_turn": 0.002,
}  # fmt: skip
#: Noise of one sample of each block, by the names of the rig description.
NOISE = {
    "gyroscope": "angular_rate", "accelerometer": "specific_force", "inclinometer": "inclination",
    "mocap_place": "mocap_position", "mocap_turn": "mocap_orientation",
}  # fmt: skip
#: m and rad; a tracker's origin is anywhere in the room, its marker turned on the body by anything.
ANYWHERE = 100.0
#: Rows below which a tracker tells nothing.
FEWEST_POSES = 20


@dataclass(frozen=True)
class Measured:
    """What the devices of one rig read along a trajectory."""

    rig: Rig
    ceiling: Array  # (n, 3) m, world
    hinges: Array  # (n, 3) m, body
    length_std: float  # m

    @staticmethod
    def of(rig: Rig) -> Measured:
        """For the rig that a description tells of."""
        hinges = np.array([c.body_point for c in rig.cables])
        size = max(float(np.ptp(hinges, axis=0).max()), 1e-3)
        std = max(FLOOR["length"] * min(1.0, size), 5.0 * rig.tolerance["cable_length"])
        return Measured(rig, np.array([c.ceiling_point for c in rig.cables]), hinges, std)

    def blocks(self, at: Trajectory, values: Mapping[str, Array]) -> list[Block]:
        """Each device's readings (N, width) less what a trajectory predicts; cables first."""
        R = at.R
        out = [self._lengths(at, R)]
        imu, inclinometer, mocap = values.get("imu"), values.get("inclinometer"), values.get("mocap")
        if self.rig.imu is not None and imu is not None:
            out += self._block("gyroscope", imu[:, :3], lambda: self._gyroscope(at, R))
            out += self._block("accelerometer", imu[:, 3:], lambda: self._accelerometer(at, R))
        if self.rig.inclinometer is not None and inclinometer is not None:
            out += self._block("inclinometer", inclinometer, lambda: self._inclinometer(at, R))
        poses = None if mocap is None else self.tracked(mocap, at.R0)
        if poses is not None:
            out += self._block("mocap_place", poses[0], lambda: self._place(at, R))
            out += self._block("mocap_turn", poses[1], lambda: self._turn(at))
        return out

    def _block(self, name: str, reading: Array, predict: Callable[[], tuple[Array, Slopes]]) -> list[Block]:
        if not np.isfinite(reading).any():
            return []
        predicted, slopes = predict()
        off = np.full(reading.shape[1], self._offset(name))
        spread = _spread(reading)
        std = self._std(name, spread)
        return [Block(name, reading - predicted, slopes, std, np.maximum(spread, TINY), off)]

    def _offset(self, name: str) -> float:
        tolerance, gravity = self.rig.tolerance, self.rig.gravity
        return {
            "gyroscope": max(FLOOR["gyroscope"], DOUBT * tolerance["gyroscope_bias"]),
            "accelerometer": gravity * max(BIAS, DOUBT * tolerance["imu_orientation"]),
            "inclinometer": max(TILT, DOUBT * tolerance["inclinometer_orientation"]),
        }.get(name, ANYWHERE)

    def _std(self, name: str, spread: Array) -> Array:
        whole = float(np.sqrt(np.mean(spread**2)))
        floor = max(FLOOR[name], self.rig.noise.get(NOISE[name], 0.0))
        return np.asarray(np.sqrt(floor**2 + (ORDINARY * spread) ** 2 + (ACROSS * whole) ** 2))

    def _lengths(self, at: Trajectory, R: Array) -> Block:
        arms = np.einsum("nij,cj->nci", R, self.hinges)
        span = self.ceiling - at.position[:, None, :] - arms
        distance = np.linalg.norm(span, axis=2)
        unit = span / distance[:, :, None]
        turned = np.einsum("nci,nij,cjk->nck", unit, R, skew(self.hinges))
        slope = np.concatenate([-unit, turned], axis=2)
        lengths = np.array([c.length for c in self.rig.cables])
        std = np.full(lengths.size, self.length_std)
        off = np.full(lengths.size, LENGTH * float(lengths.max()))
        return Block("cables", lengths - distance, (slope, None, None), std, std / ORDINARY, off)

    def _gyroscope(self, at: Trajectory, R: Array) -> tuple[Array, Slopes]:
        R_imu = rotation(_given(self.rig.imu))
        by_rate = np.eye(3) - 0.5 * skew(at.turn)
        slope = np.zeros((R.shape[0], 3, 6))
        slope[:, :, 3:] = R_imu.T @ by_rate
        by_turn = np.zeros_like(slope)
        by_turn[:, :, 3:] = R_imu.T @ (0.5 * skew(at.turn_rate))
        return at.rate @ R_imu, (by_turn, slope, None)

    def _accelerometer(self, at: Trajectory, R: Array) -> tuple[Array, Slopes]:
        mount = _given(self.rig.imu)
        R_imu, arm = rotation(mount), mount.position
        proper = at.proper_acceleration(self.rig.gravity)
        rate, change = at.rate, at.rate_change
        body = proper + cross(change, arm) + cross(rate, cross(rate, arm))
        by_pose = np.zeros((R.shape[0], 3, 6))
        by_pose[:, :, 3:] = R_imu.T @ skew(proper)
        by_rate = np.zeros_like(by_pose)
        across = cross(rate, arm)
        by_rate[:, :, 3:] = -R_imu.T @ (skew(across) + skew(rate) @ skew(arm))
        by_change = np.zeros_like(by_pose)
        by_change[:, :, :3] = R_imu.T @ np.swapaxes(R, 1, 2)
        by_change[:, :, 3:] = -R_imu.T @ skew(arm) @ (np.eye(3) - 0.5 * skew(at.turn))
        return body @ R_imu, (by_pose, by_rate, by_change)

    def _inclinometer(self, at: Trajectory, R: Array) -> tuple[Array, Slopes]:
        axes = rotation(_given(self.rig.inclinometer))[:, :2].T
        up = R[:, 2]
        sine = np.clip(up @ axes.T, -0.99, 0.99)
        slope = np.zeros((R.shape[0], 2, 6))
        slope[:, :, 3:] = (axes @ skew(up)) / np.sqrt(1.0 - sine**2)[:, :, None]
        return np.arcsin(sine), (slope, None, None)

    def frame(self, poses: Array, R0: Array) -> Rotation | None:
        """World vectors into the tracker's axes; None where the marker is not described or not seen.

        R0: (3, 3) attitude in which the body rests.
        """
        mount, known = self.rig.mocap, seen(poses)
        if mount is None or np.count_nonzero(known) < FEWEST_POSES:
            return None
        middle = Rotation.from_quat(poses[known, 3:]).mean()
        return middle * Rotation.from_quat(mount.orientation).inv() * Rotation.from_matrix(R0).inv()

    def tracked(self, poses: Array, R0: Array) -> tuple[Array, Array] | None:
        """(N, 3) the marker's place in world axes and (N, 3) the body's turn from its mean, body axes."""
        frame = self.frame(poses, R0)
        if frame is None:
            return None
        known = seen(poses)
        turns = Rotation.from_quat(poses[known, 3:])
        place, turn = np.full((2, len(poses), 3), np.nan)
        place[known] = frame.inv().apply(poses[known, :3])
        marker = rotation(_given(self.rig.mocap))
        turn[known] = (turns.mean().inv() * turns).as_rotvec() @ marker.T
        return place, turn

    def _place(self, at: Trajectory, R: Array) -> tuple[Array, Slopes]:
        arm = _given(self.rig.mocap).position
        slope = np.concatenate([np.broadcast_to(np.eye(3), R.shape), -R @ skew(arm)], axis=2)
        return at.position + R @ arm, (slope, None, None)

    def _turn(self, at: Trajectory) -> tuple[Array, Slopes]:
        slope = np.zeros((len(at.turn), 3, 6))
        slope[:, :, 3:] = np.eye(3)
        return at.turn, (slope, None, None)


def seen(poses: Array) -> NDArray[np.bool_]:
    """(N,) whether each pose (N, 7) is measured: a number everywhere, and a quaternion with a length."""
    return np.asarray(np.isfinite(poses).all(axis=1) & (np.abs(poses[:, 3:]).max(axis=1) > TINY))


def mean(rows: Array) -> Array:
    """(w,) means of what is measured, NaN where nothing is."""
    known = np.isfinite(rows)
    count = np.where(known.any(axis=0), known.sum(axis=0), np.nan)
    return np.asarray(np.where(known, rows, 0.0).sum(axis=0) / count)


def _spread(reading: Array) -> Array:
    """(w,) std of the readings, zero where nothing is measured."""
    return np.sqrt(np.nan_to_num(mean((reading - mean(reading)) ** 2)))


def _given(mount: Mount | None) -> Mount:
    assert mount is not None
    return mount
