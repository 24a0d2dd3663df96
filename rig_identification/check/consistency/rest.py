"""How well readings at rest agree with the description: the balance of chapter 2 with enlarged doubts.

Unknown are the centre of mass and the mass, each recording's pose and tensions, and what rig and
sensors may ordinarily be off by: gains, zeros, lengths, the angles' zero and the accelerometer's
bias, the same in all recordings. Their standard deviations are wide: what the later search would
name (a cell 1 % high, a cable 5 mm longer) is ordinary here, so that only what no such error
explains is a fault of the set-up. Levenberg-Marquardt from a level body below its ceiling points.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.reduced import Reduced
from rig_identification.recording import Dummy
from rig_identification.rig import Rig
from rig_identification.statics.balance import Suspension, balance, skew, spans
from rig_identification.statics.equilibrium import hanging_mass

Array = NDArray[np.float64]

#: Tolerances that an ordinary error may have here: the largest effects of sensors and rig have a few dozen.
DOUBT = 20.0
#: Ordinary gains of cells, and errors of the scale, whatever the tolerances say.
GAIN, SCALE = 0.03, 0.02
#: Ordinary zeros of angles (rad) and of accelerometers (share of gravity).
TILT, BIAS = 0.01, 0.02
#: Ordinary errors of lengths as a share of the longest cable.
LENGTH = 0.003
#: What readings at rest may differ by beside those, as shares of the mean tension, rad and shares of gravity.
#: A run's means stand for rest to second order of its swing.
READING = {"static": (0.003, 0.0005, 0.0005), "dynamic": (0.02, 0.005, 0.01)}
#: Ordinary errors of a known mass and of its place, as shares of the mass and of the hinges' span.
DUMMY_MASS, DUMMY_PLACE = 0.02, 0.005
#: Errors of the equations themselves, metres and weights: loose at first, so that steps are long where the
#: lengths bend the way to the solution, and exact next to all readings in the end.
EXACT = (0.1, 0.01, 0.001, 1e-4)
#: What a belief that a hypothesis gives up may be off by: shares of the weight, of a mass and of the span.
FREE = 1.0
#: Steps at each of them.
ITERATIONS = 8
#: Std of a belief that is said to be certain: a tolerance of zero.
CERTAIN = 1e-9


@dataclass(frozen=True)
class Loosened:
    """Beliefs that a hypothesis gives up."""

    zeros: tuple[str, ...] = ()  # cables whose cell's zero may be anything
    gains: tuple[str, ...] = ()  # cables whose cell's gain may be anything
    dummy_mass: bool = False
    dummy_place: bool = False


@dataclass(frozen=True)
class RestFit:
    """The best account of the readings at rest."""

    square: float  # sum of squares of readings and beliefs in units of their std
    readings: int
    mass: float  # kg
    center_of_mass: Array  # (3,) m, body
    poses: tuple[tuple[Array, Array], ...]  # position (3,) and attitude (3, 3) of each recording
    tension: Array  # (k, n) N
    unknown: Array  # (u,) at the solution
    covariance: Array  # (u, u)
    columns: Mapping[str, slice]
    expected: tuple[Mapping[str, Array], ...]  # readings of the described rig, by device

    @property
    def std(self) -> Array:
        """(u,) of all unknowns."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self.covariance), 0.0)))

    def value(self, name: str) -> tuple[Array, Array]:
        """Values and std of one block of unknowns."""
        return self.unknown[self.columns[name]], self.std[self.columns[name]]


@dataclass
class RestModel:
    """Residuals of the readings at rest and their slopes."""

    rig: Rig
    recordings: Sequence[Reduced]
    loosened: Loosened = field(default_factory=Loosened)

    def __post_init__(self) -> None:
        rig, n, k = self.rig, len(self.rig.cables), len(self.recordings)
        self.suspension = Suspension.of(rig)
        self.span = max(float(np.ptp(self.suspension.body, axis=0).max()), 1e-3)
        self.mass_guess = rig.mass or self._mass_of_tensions() or self.span
        self.R_incl = _rotation(rig.inclinometer)
        self.R_imu = _rotation(rig.imu)
        sizes = {"center": 3, "mass": 1, "pose": 6 * k, "tension": n * k, "gain": n, "zero": n}
        sizes |= {"length": n, "tilt": 2, "bias": 3, "dummy_mass": k, "dummy_place": 3 * k}
        edges = np.cumsum([0, *sizes.values()])
        self.columns = {name: slice(a, b) for name, a, b in zip(sizes, edges[:-1], edges[1:], strict=True)}
        self.size = int(edges[-1])

    def _mass_of_tensions(self) -> float | None:
        for recording in self.recordings:
            given = [recording.values.get(c.name) for c in self.rig.cables]
            if recording.dummy is None and all(v is not None for v in given):
                total = float(np.sum([np.abs(v) for v in given if v is not None]))
                return total / self.rig.gravity if total > 0.0 else None
        return None

    def prior_std(self) -> Array:
        """(u,) std of the beliefs; infinite where there is none."""
        rig, n = self.rig, len(self.rig.cables)
        tolerance, loose = rig.tolerance, self.loosened
        std = np.full(self.size, np.inf)
        names = [c.name for c in rig.cables]
        weight = self.mass_guess * rig.gravity
        std[self.columns["center"]] = self.span
        std[self.columns["mass"]] = (
            1.0 if rig.mass is None else np.hypot(SCALE, 10.0 * (rig.mass_std or 0.0) / rig.mass)
        )
        gain, zero = max(GAIN, DOUBT * tolerance["load_cell_gain"]), DOUBT * tolerance["load_cell_zero"]
        zero = min(zero, GAIN * weight)
        std[self.columns["gain"]] = [FREE if name in loose.gains else gain for name in names]
        std[self.columns["zero"]] = [FREE * weight if name in loose.zeros else zero for name in names]
        longest = float(np.max(self.suspension.length))
        std[self.columns["length"]] = np.hypot(
            DOUBT * (tolerance["cable_length"] + tolerance["hinge_position"]), LENGTH * longest
        ) * np.ones(n)
        std[self.columns["tilt"]] = max(TILT, DOUBT * tolerance["inclinometer_orientation"])
        std[self.columns["bias"]] = rig.gravity * max(BIAS, DOUBT * tolerance["imu_orientation"])
        heavy = np.array([r.dummy.mass if r.dummy else 1.0 for r in self.recordings])
        std[self.columns["dummy_mass"]] = heavy * (FREE if loose.dummy_mass else DUMMY_MASS)
        std[self.columns["dummy_place"]] = self.span * (FREE if loose.dummy_place else DUMMY_PLACE)
        return np.asarray(np.maximum(std, CERTAIN))

    def start(self) -> Array:
        """(u,) unknowns of a level body; poses are kept apart (:meth:`start_poses`)."""
        x = np.zeros(self.size)
        x[self.columns["center"]] = self.suspension.body.mean(axis=0) - [0.0, 0.0, 0.3 * self.span]
        x[self.columns["tension"]] = 1.0 / len(self.rig.cables)
        return x

    def start_poses(self) -> list[tuple[Array, Array]]:
        """Level, turned about the vertical so that hinges lie below their ceiling points."""
        ceiling, body = self.suspension.ceiling, self.suspension.body
        c, b = ceiling - ceiling.mean(axis=0), body - body.mean(axis=0)
        heading = np.arctan2(np.sum(b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]), np.sum(b[:, :2] * c[:, :2]))
        R = Rotation.from_rotvec([0.0, 0.0, heading]).as_matrix()
        aside = c - b @ R.T
        drop = np.sqrt(np.maximum(self.suspension.length**2 - np.sum(aside[:, :2] ** 2, axis=1), 1e-4))
        height = float(np.mean(ceiling[:, 2] - (body @ R.T)[:, 2] - drop))
        position = ceiling.mean(axis=0) - R @ body.mean(axis=0)
        position[2] = height
        return [(position, R) for _ in self.recordings]

    def rows(self, x: Array, poses: Sequence[tuple[Array, Array]], exact: float) -> tuple[Array, Array]:
        """Residuals in units of their std, and slopes, beliefs included."""
        parts = [self._rows_of(k, x, poses[k], exact) for k in range(len(self.recordings))]
        std = self.prior_std()
        known = np.isfinite(std)
        believed = np.where(known, x / np.where(known, std, 1.0), 0.0)
        middle = self.suspension.body.mean(axis=0)
        believed[self.columns["center"]] = (x[self.columns["center"]] - middle) / self.span
        slope = np.diag(np.where(known, 1.0 / np.where(known, std, 1.0), 0.0))
        residual = np.concatenate([*(p[0] for p in parts), believed[known]])
        return residual, np.vstack([*(p[1] for p in parts), slope[known]])

    def _dummy(self, k: int, x: Array) -> Dummy | None:
        dummy = self.recordings[k].dummy
        if dummy is None:
            return None
        mass = max(dummy.mass + x[self.columns["dummy_mass"]][k], 1e-6)
        place = dummy.position + x[self.columns["dummy_place"]][3 * k : 3 * k + 3]
        return Dummy(mass, place)

    def body_mass(self, x: Array) -> float:
        """kg; the unknown is the logarithm of its ratio to the guess."""
        return float(self.mass_guess * np.exp(np.clip(x[self.columns["mass"]][0], -5.0, 5.0)))

    def _rows_of(self, k: int, x: Array, pose: tuple[Array, Array], exact: float) -> tuple[Array, Array]:
        n, col = len(self.rig.cables), self.columns
        mass, center, dummy = self.body_mass(x), x[col["center"]], self._dummy(k, x)
        total, arm = hanging_mass(mass, center, dummy)
        tension = x[col["tension"]][k * n : (k + 1) * n]
        pose_columns = slice(col["pose"].start + 6 * k, col["pose"].start + 6 * k + 6)
        tension_columns = slice(col["tension"].start + n * k, col["tension"].start + n * (k + 1))
        at = balance(self.suspension, arm, pose[0], pose[1], tension)
        residual, slope = at.residual.copy(), np.zeros((n + 6, self.size))
        residual[:n] -= x[col["length"]]
        slope[:, pose_columns], slope[:, tension_columns] = at.pose_slope, at.tension_slope
        slope[:n, col["length"]] = -np.eye(n)
        weight = skew(np.array([0.0, 0.0, 1.0])) @ pose[1]
        slope[n + 3 :, col["center"]] = weight * (mass / total)
        slope[n + 3 :, col["mass"]] = (weight @ (center - arm) * (mass / total))[:, None]
        if dummy is not None:
            slope[n + 3 :, col["dummy_mass"].start + k] = weight @ (dummy.position - arm) / total
            place = slice(col["dummy_place"].start + 3 * k, col["dummy_place"].start + 3 * k + 3)
            slope[n + 3 :, place] = weight * (dummy.mass / total)
        parts = [(residual / exact, slope / exact)]
        parts += self._readings_of(k, x, pose, tension, total)
        return np.concatenate([p[0] for p in parts]), np.vstack([p[1] for p in parts])

    def _readings_of(
        self, k: int, x: Array, pose: tuple[Array, Array], tension: Array, total: float
    ) -> list[tuple[Array, Array]]:
        seen, col, n = self.recordings[k], self.columns, len(self.rig.cables)
        parts = []
        share, angle, part = READING[seen.kind]
        weight = total * self.rig.gravity
        pull = weight * tension
        unit = spans(self.suspension, pose[0], pose[1])[3]
        carried = pull + self.rig.cable_weight_at_cells(unit[:, 2])
        gain, zero = 1.0 + x[col["gain"]], x[col["zero"]]
        for i, cable in enumerate(self.rig.cables):
            reading = seen.values.get(cable.name)
            if reading is None or not np.isfinite(reading[0, 0]):
                continue
            sharp = 1.0 / (share * weight / n + self.rig.noise.get("tension", 0.0) * 0.1)
            row = np.zeros(self.size)
            row[col["tension"].start + n * k + i] = weight * gain[i]
            row[col["mass"]] = gain[i] * tension[i] * self.body_mass(x) * self.rig.gravity
            row[col["gain"].start + i], row[col["zero"].start + i] = carried[i], 1.0
            row[col["dummy_mass"].start + k] = gain[i] * tension[i] * self.rig.gravity if seen.dummy else 0.0
            error = gain[i] * carried[i] + zero[i] - reading[0, 0]
            parts.append((np.array([sharp * error]), sharp * row[None]))
        up = pose[1][2]
        turned = pose[1].T @ skew(np.array([0.0, 0.0, 1.0]))  # slope of R^T z by a world rotation vector
        first = col["pose"].start + 6 * k + 3
        parts += self._angles(seen, x, up, turned, first, 1.0 / angle)
        parts += self._force(seen, x, up, turned, first, 1.0 / (part * self.rig.gravity))
        return parts

    def _angles(
        self, seen: Reduced, x: Array, up: Array, turned: Array, first: int, sharp: float
    ) -> list[tuple[Array, Array]]:
        reading = seen.values.get("inclinometer")
        if reading is None or self.R_incl is None or not np.isfinite(reading).all():
            return []
        axes = self.R_incl[:, :2].T
        sine = np.clip(axes @ up, -0.99, 0.99)
        slope = np.zeros((2, self.size))
        slope[:, first : first + 3] = (axes @ turned) / np.sqrt(1.0 - sine**2)[:, None]
        slope[:, self.columns["tilt"]] = np.eye(2)
        error = np.arcsin(sine) + x[self.columns["tilt"]] - reading[0]
        return [(sharp * error, sharp * slope)]

    def _force(
        self, seen: Reduced, x: Array, up: Array, turned: Array, first: int, sharp: float
    ) -> list[tuple[Array, Array]]:
        reading = seen.values.get("imu")
        if reading is None or self.R_imu is None or not np.isfinite(reading[0, 3:]).all():
            return []
        g = self.rig.gravity
        slope = np.zeros((3, self.size))
        slope[:, first : first + 3] = g * self.R_imu.T @ turned
        slope[:, self.columns["bias"]] = np.eye(3)
        error = g * self.R_imu.T @ up + x[self.columns["bias"]] - reading[0, 3:]
        return [(sharp * error, sharp * slope)]


def fit_rest(
    rig: Rig,
    recordings: Sequence[Reduced],
    loosened: Loosened | None = None,
    start: RestFit | None = None,
) -> RestFit | None:
    """Fit the readings at rest; None where there is no recording or no pose holds the body.

    start: a fit of the same recordings with other readings, from whose poses this one begins.
    """
    if not recordings:
        return None
    model = RestModel(rig, recordings, loosened or Loosened())
    if start is None:
        at = _Point(model, model.start(), model.start_poses(), EXACT[0])
        for exact in EXACT:
            at = _settled(_Point(model, at.x, at.poses, exact))
    else:
        at = _settled(_Point(model, start.unknown, start.poses, EXACT[-1]))
    if not np.isfinite(at.cost):
        return None
    return _fit_of(model, at.x, at.poses, at.slope, at.cost)


class _Point:
    """Unknowns and poses with the residuals there."""

    def __init__(
        self, model: RestModel, x: Array, poses: Sequence[tuple[Array, Array]], exact: float
    ) -> None:
        self.model, self.x, self.poses, self.exact = model, x, poses, exact
        self.residual, self.slope = model.rows(x, poses, exact)
        self.cost = float(self.residual @ self.residual)

    def moved(self, step: Array) -> _Point:
        """After a step."""
        return _Point(self.model, *_moved(self.model, self.x, self.poses, step), self.exact)


def _settled(at: _Point) -> _Point:
    """Levenberg-Marquardt from a point."""
    damping = 1e-6
    for _ in range(ITERATIONS):
        normal = at.slope.T @ at.slope
        scaled = normal + damping * np.diag(np.diag(normal) + 1e-12)
        trial = at.moved(-np.linalg.solve(scaled, at.slope.T @ at.residual))
        if not trial.cost < at.cost:
            damping *= 30.0
            continue
        done = at.cost - trial.cost < 1e-6 * (1.0 + at.cost)
        at, damping = trial, 0.1 * damping
        if done:
            break
    return at


def _moved(
    model: RestModel, x: Array, poses: Sequence[tuple[Array, Array]], step: Array
) -> tuple[Array, list[tuple[Array, Array]]]:
    """Unknowns and poses after a step, turns at most half a radian."""
    pose = step[model.columns["pose"]].reshape(-1, 6)
    longest = float(np.max(np.abs(pose))) if pose.size else 0.0
    step = step * min(1.0, 0.5 / max(longest, 1e-12))
    pose = step[model.columns["pose"]].reshape(-1, 6)
    moved = [
        (p + d[:3], Rotation.from_rotvec(d[3:]).as_matrix() @ R)
        for (p, R), d in zip(poses, pose, strict=True)
    ]
    x = x + step
    x[model.columns["pose"]] = 0.0
    return x, moved


def _fit_of(
    model: RestModel, x: Array, poses: Sequence[tuple[Array, Array]], slope: Array, cost: float
) -> RestFit:
    covariance = np.linalg.pinv(slope.T @ slope, hermitian=True)
    n, k = len(model.rig.cables), len(poses)
    mass = model.body_mass(x)
    totals = [hanging_mass(mass, x[model.columns["center"]], r.dummy)[0] for r in model.recordings]
    shares = x[model.columns["tension"]].reshape(k, n)
    tension = shares * np.array(totals)[:, None] * model.rig.gravity
    expected = tuple(_expected(model, tension[i], poses[i]) for i in range(k))
    beliefs = int(np.count_nonzero(np.isfinite(model.prior_std())))
    readings = len(slope) - beliefs - k * (n + 6)
    return RestFit(
        cost, readings, mass, x[model.columns["center"]], tuple(poses), tension, x, covariance,
        model.columns, expected,
    )  # fmt: skip


def square_with(
    without: RestFit, rig: Rig, recordings: Sequence[Reduced], devices: frozenset[str], loosened: Loosened
) -> float:
    """Sum of squares once the readings of ``devices`` join a fit that did without them, to first order.

    Readings that a fit predicts with covariance J C J' and that have noise of their own, 1 here, add
    e' (1 + J C J')^-1 e.
    """
    model = RestModel(rig, recordings, loosened)
    covariance = without.covariance.copy()
    plain, loose = RestModel(rig, recordings).prior_std(), model.prior_std()
    freed = np.flatnonzero(loose > plain * 1.001)
    covariance[freed, freed] += loose[freed] ** 2 - plain[freed] ** 2
    parts = []
    n = len(rig.cables)
    for k, (position, R) in enumerate(without.poses):
        seen = recordings[k]
        only = replace(seen, values={d: v for d, v in seen.values.items() if d in devices})
        model.recordings = [*recordings[:k], only, *recordings[k + 1 :]]
        dummy = model._dummy(k, without.unknown)
        total = hanging_mass(without.mass, without.center_of_mass, dummy)[0]
        tension = without.unknown[model.columns["tension"]][k * n : (k + 1) * n]
        parts += model._readings_of(k, without.unknown, (position, R), tension, total)
    if not parts:
        return without.square
    miss, slope = np.concatenate([p[0] for p in parts]), np.vstack([p[1] for p in parts])
    spread = np.eye(miss.size) + slope @ covariance @ slope.T
    # A fit without these readings may leave directions so open that rounding eats the 1
    return without.square + float(miss @ np.linalg.pinv(spread, hermitian=True) @ miss)


def _expected(model: RestModel, tension: Array, pose: tuple[Array, Array]) -> dict[str, Array]:
    unit = spans(model.suspension, pose[0], pose[1])[3]
    carried = tension + model.rig.cable_weight_at_cells(unit[:, 2])
    out = {cable.name: carried[i : i + 1] for i, cable in enumerate(model.rig.cables)}
    up = pose[1][2]
    if model.R_incl is not None:
        out["inclinometer"] = np.arcsin(np.clip(model.R_incl[:, :2].T @ up, -1.0, 1.0))
    if model.R_imu is not None:
        out["imu"] = model.rig.gravity * model.R_imu.T @ up
    return out


def _rotation(mount: object) -> Array | None:
    orientation = getattr(mount, "orientation", None)
    return None if orientation is None else np.asarray(Rotation.from_quat(orientation).as_matrix())
