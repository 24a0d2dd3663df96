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
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.reduced import PER_SPAN, Reduced
from rig_identification.check.consistency.rest import BIAS, DOUBT, LENGTH, TILT
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
class Trajectory:
    """Pose and its derivatives at the instants of a run."""

    position: Array  # (N, 3) m, world
    velocity: Array  # (N, 3)
    acceleration: Array  # (N, 3)
    turn: Array  # (N, 3) rotation vector from the rest attitude, body axes
    turn_rate: Array  # (N, 3)
    turn_change: Array  # (N, 3)
    R0: Array  # (3, 3) rest attitude

    @property
    def R(self) -> Array:
        """(N, 3, 3) body to world."""
        return np.asarray(self.R0 @ Rotation.from_rotvec(self.turn).as_matrix())

    @property
    def rate(self) -> Array:
        """(N, 3) rad/s, body axes, to third order of the turn."""
        q, v = self.turn, self.turn_rate
        once = cross(q, v)
        return np.asarray(v - 0.5 * once + cross(q, once) / 6.0)

    @property
    def rate_change(self) -> Array:
        """(N, 3) rad/s^2."""
        q, v, a = self.turn, self.turn_rate, self.turn_change
        once = cross(q, a)
        twice = cross(v, cross(q, v)) + cross(q, once)
        return np.asarray(a - 0.5 * once + twice / 6.0)

    def proper_acceleration(self, gravity: float) -> Array:
        """(N, 3) m/s^2: specific force at the body's datum, body axes."""
        total = self.acceleration + np.array([0.0, 0.0, gravity])
        return np.asarray(np.einsum("nji,nj->ni", self.R, total))


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


@dataclass(frozen=True)
class _Block:
    """Readings of one kind about a trajectory: what is missed, and slopes by pose, velocity, acceleration."""

    name: str
    miss: Array  # (N, w), NaN where not measured
    slopes: tuple[Array | None, Array | None, Array | None]  # (N, w, 6) each
    std: Array  # (w,)
    spread: Array  # (w,) std of the readings themselves
    constant_std: Array  # (w,) what a reading may be off by throughout


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
        self.spline = _Spline(run.time.size, run.kernel, AWAY * np.repeat([length, 1.0], 3))
        size = max(float(np.ptp(self.hinges, axis=0).max()), 1e-3)
        self.length_std = max(FLOOR["length"] * min(1.0, size), 5.0 * rig.tolerance["cable_length"])

    def at_rest(self) -> Trajectory:
        """No motion at all."""
        zero = np.zeros((self.run.time.size, 3))
        place = np.tile(self.position, (self.run.time.size, 1))
        return Trajectory(place, zero, zero, zero, zero, zero, self.R0)

    def fit(self, values: Mapping[str, Array], about: Trajectory | None = None) -> MotionFit:
        """Fit the motion to readings by device (N, width), linear about a trajectory, by default rest."""
        at = about or self.at_rest()
        blocks = self._blocks(at, values)
        try:
            change, constants = self.spline.solve(blocks)
        except (np.linalg.LinAlgError, ValueError):  # a motion that has left every bound has no next step
            return self.at(values, at)
        left = {b.name: self.spline.left(b, change, constants[b.name]) for b in blocks}
        return self._judged(blocks, left, self._moved(at, change))

    def once(self, values: Mapping[str, Array], about: Trajectory) -> MotionFit:
        """One step from a trajectory, judged where it ends."""
        return self.at(values, self.fit(values, about).trajectory)

    def settled(self, values: Mapping[str, Array], about: Trajectory | None = None) -> MotionFit:
        """The same, linearised anew about the motion that was found until it settles.

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

    def _stepped(self, blocks: list[_Block], at: Trajectory) -> Trajectory:
        try:
            return self._moved(at, self.spline.solve(blocks)[0])
        except (np.linalg.LinAlgError, ValueError):  # a motion that has left every bound has no next step
            return at

    def at(self, values: Mapping[str, Array], at: Trajectory) -> MotionFit:
        """What a trajectory leaves of the readings, each reading's constant taken off."""
        return self._looked_at(self._blocks(at, values), at)

    def _looked_at(self, blocks: list[_Block], at: Trajectory) -> MotionFit:
        return self._judged(blocks, {b.name: b.miss - _constant(b) for b in blocks}, at)

    def _judged(self, blocks: list[_Block], left: Mapping[str, Array], at: Trajectory) -> MotionFit:
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

    def _blocks(self, at: Trajectory, values: Mapping[str, Array]) -> list[_Block]:
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
            blocks.append(_Block(name, reading - predicted, slopes, std, np.maximum(spread, TINY), off))
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

    def _lengths(self, at: Trajectory, R: Array) -> _Block:
        arms = np.einsum("nij,cj->nci", R, self.hinges)
        span = self.ceiling - at.position[:, None, :] - arms
        distance = np.linalg.norm(span, axis=2)
        unit = span / distance[:, :, None]
        turned = np.einsum("nci,nij,cjk->nck", unit, R, skew(self.hinges))
        slope = np.concatenate([-unit, turned], axis=2)
        lengths = np.array([c.length for c in self.rig.cables])
        std = np.full(lengths.size, self.length_std)
        off = np.full(lengths.size, LENGTH * float(lengths.max()))
        return _Block("cables", lengths - distance, (slope, None, None), std, std / ORDINARY, off)

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


class _Spline:
    """Cubic B-spline of six numbers over a run's evenly spaced instants, and its least squares.

    Each span between two knots holds ``PER_SPAN`` instants, so that what one span adds to the normal
    equations is one product of matrices.
    """

    def __init__(self, instants: int, step: float, away: Array) -> None:
        self.away = away
        self.spans = instants // PER_SPAN
        self.count = self.spans + 3
        h = PER_SPAN * step
        s = (np.arange(PER_SPAN) + 0.5) / PER_SPAN
        self.basis = (
            np.stack([(1 - s) ** 3, 3 * s**3 - 6 * s**2 + 4, -3 * s**3 + 3 * s**2 + 3 * s + 1, s**3], 1)
            / 6.0,
            np.stack([-((1 - s) ** 2), 3 * s**2 - 4 * s, -3 * s**2 + 2 * s + 1, s**2], 1) / (2.0 * h),
            np.stack([1 - s, 3 * s - 2, -3 * s + 1, s], 1) / h**2,
        )
        # Lower band storage: entry (row, column) of the matrix stands at [row - column, column]
        row = np.arange(24)[:, None] + np.arange(6)
        self._block, self._row = np.minimum(row // 6, 4), row % 6

    def rows(self, block: _Block) -> Array:
        """(spans, PER_SPAN w, 24) slopes by the four knots' numbers about each span, over the std."""
        w = block.std.size
        total = np.zeros((self.spans, PER_SPAN, w, 4, 6))
        for slope, basis in zip(block.slopes, self.basis, strict=True):
            if slope is not None:
                parts = slope.reshape(self.spans, PER_SPAN, w, 1, 6)
                total += parts * basis[None, :, None, :, None]
        known = np.isfinite(block.miss).reshape(self.spans, PER_SPAN, w)
        total *= (known / block.std)[..., None, None]
        return total.reshape(self.spans, PER_SPAN * w, 24)

    def solve(self, blocks: list[_Block]) -> tuple[tuple[Array, Array, Array], dict[str, Array]]:
        """Changes of pose, velocity and acceleration (N, 6) each, and each block's constants (w,)."""
        widths = [b.std.size for b in blocks]
        starts = np.cumsum([0, *widths])
        rows = np.concatenate([self.rows(b) for b in blocks], axis=1)
        miss = np.concatenate([self._sharp(b) for b in blocks], axis=1)
        ones = np.concatenate([self._ones(b, starts, k) for k, b in enumerate(blocks)], axis=1)
        transposed = np.swapaxes(rows, 1, 2)
        gram, right = transposed @ rows, transposed @ np.concatenate([miss[..., None], ones], axis=2)
        prior = np.concatenate([1.0 / b.constant_std**2 for b in blocks])
        corner = np.einsum("smk,smk->k", ones, ones) + prior
        right_constant = np.einsum("smk,sm->k", ones, miss)
        factor = (cholesky_banded(self._banded(gram), lower=True), True)
        edge = self._scattered(right)
        through = cho_solve_banded(factor, edge)
        schur = np.diag(corner * (1.0 + 1e-9)) - edge[:, 1:].T @ through[:, 1:]
        constant = np.linalg.solve(schur, right_constant - edge[:, 1:].T @ through[:, 0])
        knots = (through[:, 0] - through[:, 1:] @ constant).reshape(self.count, 6)
        near = np.stack([knots[k : k + self.spans] for k in range(4)], axis=1)
        change = [np.einsum("pk,skd->spd", basis, near).reshape(-1, 6) for basis in self.basis]
        constants = {b.name: constant[s : s + w] for b, s, w in zip(blocks, starts, widths, strict=False)}
        return (change[0], change[1], change[2]), constants

    def _sharp(self, block: _Block) -> Array:
        """(spans, PER_SPAN w) what is missed over its std."""
        miss = np.where(np.isfinite(block.miss), block.miss, 0.0) / block.std
        return np.asarray(miss.reshape(self.spans, -1))

    def _ones(self, block: _Block, starts: NDArray[np.intp], k: int) -> Array:
        """(spans, PER_SPAN w, constants) slopes by the constants of all blocks."""
        w = block.std.size
        out = np.zeros((self.spans, PER_SPAN, w, int(starts[-1])))
        known = np.isfinite(block.miss).reshape(self.spans, PER_SPAN, w) / block.std
        for j in range(w):
            out[:, :, j, int(starts[k]) + j] = known[:, :, j]
        return out.reshape(self.spans, PER_SPAN * w, -1)

    def _scattered(self, by_span: Array) -> Array:
        """(6 count, m) from (spans, 24, m): what each span has of its four knots."""
        out = np.zeros((self.count, 6, by_span.shape[2]))
        for k in range(4):
            out[k : k + self.spans] += by_span[:, 6 * k : 6 * k + 6]
        return out.reshape(6 * self.count, -1)

    def _banded(self, gram: Array) -> Array:
        """Lower band of the normal matrix, with the belief that the body stays near rest."""
        blocks = np.zeros((self.count, 5, 6, 6))
        for low in range(4):
            for high in range(low, 4):
                part = gram[:, 6 * high : 6 * high + 6, 6 * low : 6 * low + 6]
                blocks[low : low + self.spans, high - low] += part
        blocks[:, 0] += np.diag(1.0 / self.away**2)
        band = blocks[:, self._block, self._row, np.arange(6)]
        return np.ascontiguousarray(np.moveaxis(band, 1, 0).reshape(24, 6 * self.count))

    def left(self, block: _Block, change: tuple[Array, Array, Array], constant: Array) -> Array:
        """(N, w) what a change leaves of a block, its constants taken off."""
        left = block.miss - constant
        for slope, moved in zip(block.slopes, change, strict=True):
            if slope is not None:
                left = left - np.einsum("nwd,nd->nw", slope, moved)
        return left


def _upside_down(at: Trajectory) -> bool:
    return bool(np.max(np.abs(at.turn)) > UPSIDE_DOWN)


def cross(a: Array, b: Array) -> Array:
    """(..., 3) a x b; numpy's own spends ten times as long on finding out the axes of small arrays."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def _spread(reading: Array) -> Array:
    """(w,) std of the readings, zero where nothing is measured."""
    return np.sqrt(np.nan_to_num(_mean((reading - _mean(reading)) ** 2)))


def _mean(rows: Array) -> Array:
    """(w,) means of what is measured, NaN where nothing is."""
    known = np.isfinite(rows)
    count = np.where(known.any(axis=0), known.sum(axis=0), np.nan)
    return np.asarray(np.where(known, rows, 0.0).sum(axis=0) / count)


def _constant(block: _Block) -> Array:
    """(w,) the constant that a reading is off by, held by what is believed of it."""
    weight = np.isfinite(block.miss).sum(axis=0) / block.std**2
    return np.asarray(_mean(block.miss) * weight / (weight + 1.0 / block.constant_std**2))


def _rotation(mount: object) -> Array:
    return np.asarray(Rotation.from_quat(mount.orientation).as_matrix())  # type: ignore[attr-defined]
