"""How well readings at rest agree with the description: the balance of chapter 2 with enlarged doubts.

Unknown are the centre of mass and the mass, each recording's pose and tensions, and what rig and
sensors may ordinarily be off by: gains, zeros, lengths, the angles' zero and the accelerometer's
bias, the same in all recordings. Their standard deviations are wide: what the later search would
name (a cell 1 % high, a cable 5 mm longer) is ordinary here, so that only what no such error
explains is a fault of the set-up. Levenberg-Marquardt from a level body below its ceiling points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.reduced import Reduced
from rig_identification.check.consistency.trajectory import rotation
from rig_identification.model.so3 import skew
from rig_identification.recording import Dummy
from rig_identification.rig import Rig
from rig_identification.statics.balance import Suspension, balance, spans
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
#: What a belief that a hypothesis gives up may be off by: shares of the weight, of a mass and of the span.
FREE = 1.0
#: Std of a belief that is said to be certain: a tolerance of zero.
CERTAIN = 1e-9


@dataclass(frozen=True)
class Loosened:
    """Beliefs that a hypothesis gives up."""

    zeros: tuple[str, ...] = ()  # cables whose cell's zero may be anything
    gains: tuple[str, ...] = ()  # cables whose cell's gain may be anything
    dummy_mass: bool = False
    dummy_place: bool = False


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
        self.R_incl = None if rig.inclinometer is None else rotation(rig.inclinometer)
        self.R_imu = None if rig.imu is None else rotation(rig.imu)
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

    def dummy(self, k: int, x: Array) -> Dummy | None:
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
        mass, center, dummy = self.body_mass(x), x[col["center"]], self.dummy(k, x)
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
        parts += self.readings_of(k, x, pose, tension, total)
        return np.concatenate([p[0] for p in parts]), np.vstack([p[1] for p in parts])

    def readings_of(
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
