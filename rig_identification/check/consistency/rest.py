"""Fits of the readings at rest, and what readings cost that join one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency.reduced import Reduced
from rig_identification.check.consistency.rest_model import Loosened, RestModel
from rig_identification.rig import Rig
from rig_identification.statics.balance import spans
from rig_identification.statics.equilibrium import hanging_mass

Array = NDArray[np.float64]

#: Errors of the equations themselves, metres and weights: loose at first, so that steps are long where the
#: lengths bend the way to the solution, and exact next to all readings in the end.
EXACT = (0.1, 0.01, 0.001, 1e-4)
#: Steps at each of them.
ITERATIONS = 8


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


def joined(
    without: RestFit, rig: Rig, recordings: Sequence[Reduced], devices: frozenset[str], loosened: Loosened
) -> RestFit:
    """A fit that did without the readings of ``devices`` once they join it, to first order; same poses.

    Readings that a fit predicts with covariance J C J' and that have noise of their own, 1 here, add
    e' (1 + J C J')^-1 e to the sum of squares.
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
        dummy = model.dummy(k, without.unknown)
        total = hanging_mass(without.mass, without.center_of_mass, dummy)[0]
        tension = without.unknown[model.columns["tension"]][k * n : (k + 1) * n]
        parts += model.readings_of(k, without.unknown, (position, R), tension, total)
    if not parts:
        return without
    miss, slope = np.concatenate([p[0] for p in parts]), np.vstack([p[1] for p in parts])
    across = covariance @ slope.T
    # A fit without these readings may leave directions so open that rounding eats the 1
    inverse = np.linalg.pinv(np.eye(miss.size) + slope @ across, hermitian=True)
    return replace(
        without,
        square=without.square + float(miss @ inverse @ miss),
        unknown=without.unknown - across @ inverse @ miss,
        covariance=covariance - across @ inverse @ across.T,
    )


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
