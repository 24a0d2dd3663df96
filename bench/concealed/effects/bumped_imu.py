"""Outside the table: the IMU is bumped while a run is recorded, and turned from then on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.jumping_zero import later
from bench.concealed.scene import Array, Plan, Scene
from bench.concealed.signals import Readings


@dataclass(frozen=True)
class BumpedImu(Effect):
    """From an instant of the first run on, and in every later recording, the IMU is turned."""

    name = "bumped_imu"
    outside = True
    near = ("imu_misalignment",)
    turn: Array  # (3,) rad, rotation vector, IMU axes
    instant: float  # s after the release of the first run

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> BumpedImu:
        """From a quarter of a degree."""
        axis = rng.normal(size=3)
        angle = log_size(size, 0.005, 0.06)
        return cls(angle * axis / np.linalg.norm(axis), float(rng.uniform(3.0, 9.0)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "imu", "from": {"recording": "run_1", "start": self.instant}}
        return {
            "where": where,
            "parameters": {"angle": quantity(float(np.max(np.abs(self.turn))), "rad")},
        }

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        rows = later(readings, plan, self.instant)
        turn = Rotation.from_rotvec(self.turn).as_matrix()
        rate, force = readings.rate.copy(), readings.specific_force.copy()
        rate[rows], force[rows] = rate[rows] @ turn, force[rows] @ turn
        return replace(readings, rate=rate, specific_force=force)
