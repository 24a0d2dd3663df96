"""How well gyroscope, accelerometer, inclinometer and cables agree on one motion of a rigid body.

Pose over time is a cubic spline in place and turn, six numbers a knot. Every reading is a function of it
that needs neither mass nor inertia:

    length of cable i     |c_i - x - R b_i|                         constant
    angular rate          R_bi^T w
    specific force        R_bi^T (R^T (x'' + g z) + w' x r + w x (w x r))
    angle of an axis a    asin(a . R^T z)

with R = R0 exp(q), w = q' - q x q' / 2 + ..., from the rest pose (x0, R0). Least squares with a free constant
for each reading (zeros, biases and lengths belong to rest). What a model without left-out
physics may ordinarily miss is ``ORDINARY`` of each reading's own variation; correlated over the
whole run, so that a reading counts as ``INDEPENDENT`` observations however often it was sampled.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.reduced import Reduced
from rig_identification.check.consistency.rest_model import BIAS, DOUBT, LENGTH, TILT
from rig_identification.check.consistency.spline import Block, Spline
from rig_identification.check.consistency.trajectory import Trajectory, cross
from rig_identification.rig import Rig
from rig_identification.statics.balance import skew

Array = NDArray[np.float64]

#: Share of a reading's variation that ordinary errors and left-out physics leave unexplained, and share of
#: the whole device's that axes turned by a few hundredths of a radian bring over from the others.
ORDINARY, ACROSS = 0.15, 0.05
#: Spread of a reading that never changes, so that its logarithm exists.
TINY = 1e-9
#: Levels of ordinary error that a session may have.
LEVELS = (1.0, 0.3, 0.1)
#: Independent observations that one reading of one run stands for: the order of the swings in it.
INDEPENDENT = 10.0
#: Smallest variation that tells anything: rad/s, m/s^2, rad, m.
FLOOR = {"gyroscope": 0.002, "accelerometer": 0.03, "inclinometer": 0.0005, "length": 0.003}
#: Noise of one sample of each block, by the names of the rig description.
NOISE = {"gyroscope": "angular_rate", "accelerometer": "specific_force", "inclinometer": "inclination"}
#: Columns of a device's readings that each block takes.
BLOCKS = {
    "gyroscope": ("imu", slice(0, 3)),
    "accelerometer": ("imu", slice(3, 6)),
    "inclinometer": ("inclinometer", slice(0, 2)),
}
#: A pose leaves rest by so much, where no reading holds it: share of the cables' length, and rad.
AWAY = 0.2
#: rad; a rotation vector beyond half a turn stands for another attitude, and no body hangs so.
UPSIDE_DOWN = np.pi
#: Fits settle in fewer steps; one that improves by less than a tenth of a nat has settled.
STEPS, SETTLED = 8, 0.1


@dataclass(frozen=True)
class MotionFit:
    """The best motion and what it leaves of each reading."""

    cost: Mapping[str, float]  # block -> nats
    trajectory: Trajectory
    left: Mapping[str, Array]  # block -> (w,) rms of what is left over the reading's own ordinary error

    @property
    def total(self) -> float:
        """Nats by which the motion fails to explain all blocks."""
        return sum(self.cost.values())


def nats(square: Array, sharpness: Array) -> Array:
    """Nats by which readings miss, from mean squares in units of their ordinary error.

    How large the ordinary error is in this session is not known: it is the one of ``LEVELS`` of
    :data:`ORDINARY` that explains what is left best. Where all else agrees to a hundredth, a reading
    that misses by a tenth is told; where everything misses by a half, it is not. The likelihood of a reading
    has heavy tails: log1p.

    sharpness: ordinary error over the spread of the reading itself. It makes this the likelihood of
    what was recorded, whatever unit a hypothesis gives it: a reading that is scaled down until it
    vanishes beside its floor explains nothing.
    """
    level = np.asarray(LEVELS)[:, None] ** 2
    each = np.log1p(square / level) + np.log(level / LEVELS[-1] ** 2)
    return np.asarray(0.5 * INDEPENDENT * (each.min(axis=0) + 2.0 * np.log(sharpness / ORDINARY)))


class MotionModel:
    """Readings of one run as functions of the body's motion."""

    def __init__(self, rig: Rig, run: Reduced, position: Array, R0: Array) -> None:
        self.rig, self.run = rig, run
        self.position, self.R0 = position, R0
        self.ceiling = np.array([c.ceiling_point for c in rig.cables])
        self.hinges = np.array([c.body_point for c in rig.cables])
        length = float(np.mean([c.length for c in rig.cables]))
        self.spline = Spline(run.time.size, run.kernel, AWAY * np.repeat([length, 1.0], 3))
        size = max(float(np.ptp(self.hinges, axis=0).max()), 1e-3)
        self.length_std = max(FLOOR["length"] * min(1.0, size), 5.0 * rig.tolerance["cable_length"])

    def at_rest(self) -> Trajectory:
        """No motion at all."""
        zero = np.zeros((self.run.time.size, 3))
        place = np.tile(self.position, (self.run.time.size, 1))
        return Trajectory(place, zero, zero, zero, zero, zero, self.R0)

    def once(self, values: Mapping[str, Array], about: Trajectory) -> MotionFit:
        """One step from a trajectory, judged where it ends."""
        return self.at(values, self._stepped(self._blocks(about, values), about))

    def settled(self, values: Mapping[str, Array], about: Trajectory | None = None) -> MotionFit:
        """Fit the motion to readings by device (N, width), linearised after each step until it settles.

        From rest a large swing is overshot at first: a step that doubles the cost or more is taken all the
        same, and the best motion of all is kept.
        """
        at = about or self.at_rest()
        best: MotionFit | None = None
        for _ in range(STEPS + 1):
            blocks = self._blocks(at, values)
            seen = self._looked_at(blocks, at)
            if best is not None and (not np.isfinite(seen.total) or _upside_down(at)):
                break
            gained = np.inf if best is None else best.total - seen.total
            if best is None or gained > 0.0:
                best = seen
            if -best.total < gained < SETTLED:
                break
            at = self._stepped(blocks, at)
        assert best is not None
        return best

    def _stepped(self, blocks: list[Block], at: Trajectory) -> Trajectory:
        try:
            return self._moved(at, self.spline.solve(blocks)[0])
        except (np.linalg.LinAlgError, ValueError):  # a motion that has left every bound has no next step
            return at

    def at(self, values: Mapping[str, Array], at: Trajectory) -> MotionFit:
        """What a trajectory leaves of the readings, each reading's constant taken off."""
        return self._looked_at(self._blocks(at, values), at)

    def _looked_at(self, blocks: list[Block], at: Trajectory) -> MotionFit:
        return self._judged(blocks, {b.name: b.miss - _constant(b) for b in blocks}, at)

    def _judged(self, blocks: list[Block], left: Mapping[str, Array], at: Trajectory) -> MotionFit:
        cost, remains = {}, {}
        for block in blocks:
            square = _mean(left[block.name] ** 2) / block.std**2
            known = np.isfinite(square)
            square = np.where(known, square, 0.0)
            cost[block.name] = float(np.sum(nats(square, block.std / block.spread)[known]))
            remains[block.name] = np.sqrt(square)
        return MotionFit(cost, at, remains)

    def _moved(self, at: Trajectory, change: tuple[Array, Array, Array]) -> Trajectory:
        q, v, a = change
        return Trajectory(
            at.position + q[:, :3], at.velocity + v[:, :3], at.acceleration + a[:, :3],
            at.turn + q[:, 3:], at.turn_rate + v[:, 3:], at.turn_change + a[:, 3:], at.R0,
        )  # fmt: skip

    def _blocks(self, at: Trajectory, values: Mapping[str, Array]) -> list[Block]:
        R = at.R
        blocks = [self._lengths(at, R)]
        builders = {
            "gyroscope": (self.rig.imu, self._gyroscope),
            "accelerometer": (self.rig.imu, self._accelerometer),
            "inclinometer": (self.rig.inclinometer, self._inclinometer),
        }
        for name, (device, columns) in BLOCKS.items():
            mount, builder = builders[name]
            reading = values.get(device)
            if mount is None or reading is None or not np.isfinite(reading[:, columns]).any():
                continue
            reading = reading[:, columns]
            predicted, slopes = builder(at, R)
            off = np.full(reading.shape[1], self._offset(name))
            spread = _spread(reading)
            std = self._std(name, spread)
            blocks.append(Block(name, reading - predicted, slopes, std, np.maximum(spread, TINY), off))
        return blocks

    def _offset(self, name: str) -> float:
        tolerance, gravity = self.rig.tolerance, self.rig.gravity
        return {
            "gyroscope": max(FLOOR["gyroscope"], DOUBT * tolerance["gyroscope_bias"]),
            "accelerometer": gravity * max(BIAS, DOUBT * tolerance["imu_orientation"]),
            "inclinometer": max(TILT, DOUBT * tolerance["inclinometer_orientation"]),
        }[name]

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

    def _gyroscope(
        self, at: Trajectory, R: Array
    ) -> tuple[Array, tuple[Array | None, Array | None, Array | None]]:
        R_imu = _rotation(self.rig.imu)
        by_rate = np.eye(3) - 0.5 * skew(at.turn)
        slope = np.zeros((R.shape[0], 3, 6))
        slope[:, :, 3:] = R_imu.T @ by_rate
        by_turn = np.zeros_like(slope)
        by_turn[:, :, 3:] = R_imu.T @ (0.5 * skew(at.turn_rate))
        return at.rate @ R_imu, (by_turn, slope, None)

    def _accelerometer(
        self, at: Trajectory, R: Array
    ) -> tuple[Array, tuple[Array | None, Array | None, Array | None]]:
        mount = self.rig.imu
        assert mount is not None
        R_imu, arm = _rotation(mount), mount.position
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

    def _inclinometer(
        self, at: Trajectory, R: Array
    ) -> tuple[Array, tuple[Array | None, Array | None, Array | None]]:
        axes = _rotation(self.rig.inclinometer)[:, :2].T
        up = R[:, 2]
        sine = np.clip(up @ axes.T, -0.99, 0.99)
        slope = np.zeros((R.shape[0], 2, 6))
        slope[:, :, 3:] = (axes @ skew(up)) / np.sqrt(1.0 - sine**2)[:, :, None]
        return np.arcsin(sine), (slope, None, None)


def _upside_down(at: Trajectory) -> bool:
    return bool(np.max(np.abs(at.turn)) > UPSIDE_DOWN)


def _spread(reading: Array) -> Array:
    """(w,) std of the readings, zero where nothing is measured."""
    return np.sqrt(np.nan_to_num(_mean((reading - _mean(reading)) ** 2)))


def _mean(rows: Array) -> Array:
    """(w,) means of what is measured, NaN where nothing is."""
    known = np.isfinite(rows)
    count = np.where(known.any(axis=0), known.sum(axis=0), np.nan)
    return np.asarray(np.where(known, rows, 0.0).sum(axis=0) / count)


def _constant(block: Block) -> Array:
    """(w,) the constant that a reading is off by, held by what is believed of it."""
    weight = np.isfinite(block.miss).sum(axis=0) / block.std**2
    return np.asarray(_mean(block.miss) * weight / (weight + 1.0 / block.constant_std**2))


def _rotation(mount: object) -> Array:
    return np.asarray(Rotation.from_quat(mount.orientation).as_matrix())  # type: ignore[attr-defined]
