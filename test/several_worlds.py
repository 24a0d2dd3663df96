"""Sessions of a world in which everything is linear: what is known of them in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.joint import Doubt, JointInformation, Weighing
from rig_identification.result import InertialEstimate
from rig_identification.rig import CarryingFrame
from rig_identification.several.session_result import SessionResult

Array = NDArray[np.float64]

#: Sizes of the ten numbers and of their errors: kg, m, kg m^2.
BODY = np.array([1100.0, 0.95, 1.05, -0.85, 1550.0, 10.0, -15.0, 450.0, 50.0, 1600.0])
UNIT = np.array([1.0, 1e-3, 1e-3, 1e-3, 2.0, 1.0, 1.0, 2.0, 1.0, 2.0])
#: Two hinges, a gain, a scale that stay; a bias and a clock that do not.
NAMES = (
    ("cable_1.ceiling_point.x", "m", 0.0, 5e-4),
    ("cable_1.length", "m", 2.5, 5e-4),
    ("cable_1.load_cell_gain", "1", 0.0, 5e-4),
    ("imu.gyroscope_scale.x", "1", 0.0, 1e-3),
    ("imu.gyroscope_bias.x", "rad/s", 0.0, 1e-3),
    ("imu.clock", "s", 0.0, 5e-4),
)
STAYING = 4
CEILING = {"cable_1": np.zeros(3), "cable_2": np.array([2.0, 0.0, 0.0])}


@dataclass(frozen=True)
class Recordings:
    """What one session measures: y = H (x / UNIT, p) + noise of unit variance."""

    design: Array  # (n, 10 + K)
    reading: Array  # (n,)


def record(
    design: Array, doubts: Array, rng: np.random.Generator, body: Array = BODY, noise: float = 1.0
) -> Recordings:
    """Measure a body on a rig that is ``doubts`` (K,) tolerances off."""
    z = np.concatenate([body / UNIT, doubts])
    return Recordings(design, design @ z + noise * rng.standard_normal(len(design)))


def answer(
    name: str,
    told: Recordings,
    *,
    weighing: Weighing | None = None,
    ceiling: Mapping[str, Array] = CEILING,
    frame: CarryingFrame | None = None,
    lost: tuple[str, ...] = (),
    loose: float = 1.0,
    doubts: tuple[tuple[str, str, float, float], ...] = NAMES,
) -> SessionResult:
    """What a fit makes of recordings: a weak prior on the body, N(0, 1) on every doubt, the scale."""
    count = told.design.shape[1] - 10
    weak = 1e-8
    prior = np.diag([weak] * 10 + [1.0] * count)
    information = told.design.T @ told.design + prior
    pull = told.design.T @ told.reading
    pull[:10] += weak * BODY / UNIT
    if weighing is not None:
        information[0, 0] += (UNIT[0] / weighing.std) ** 2
        pull[0] += (UNIT[0] / weighing.std) ** 2 * weighing.mass / UNIT[0]
    z = np.linalg.solve(information, pull)
    scale = np.concatenate([1.0 / UNIT, np.ones(count)])
    root = np.linalg.cholesky(information).T * scale
    joint = JointInformation(
        elements=z[:10] * UNIT,
        doubts=tuple(Doubt(*told_of, float(at)) for told_of, at in zip(doubts[:count], z[10:], strict=True)),
        root=np.linalg.qr(root, mode="r"),
        weak=np.diag(weak / UNIT**2),
        weak_gradient=weak * (z[:10] - BODY / UNIT) / UNIT,
        belief=1e3 * UNIT,
        weighing=weighing,
        frame=frame,
        ceiling=ceiling,
        mounts={"imu": np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])},
    )
    covariance = np.linalg.inv(information)[:10, :10] * np.outer(UNIT, UNIT)
    return SessionResult(name, InertialEstimate(z[:10] * UNIT, loose * covariance, lost), "none", (), joint)


def designs(rng: np.random.Generator, count: int = 2, rows: int = 30) -> list[Array]:
    """Recordings that determine the body to about its ``UNIT``; doubts of a tolerance move it as far."""
    return [rng.standard_normal((rows, 10 + len(NAMES))) * 0.5 for _ in range(count)]
