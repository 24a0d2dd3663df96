"""Outside the table: a gyroscope axis feels specific force."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Readings


@dataclass(frozen=True)
class GyroGSensitivity(Effect):
    """Rate reading plus s times the specific force along another axis."""

    name = "gyro_g_sensitivity"
    outside = True
    near = ("imu_bias", "imu_misalignment")
    axis: int
    felt: int
    sensitivity: float  # rad/s per m/s^2

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> GyroGSensitivity:
        """From a good tactical unit to a toy."""
        return cls(int(rng.integers(3)), int(rng.integers(2)), signed(rng, log_size(size, 3e-4, 1e-2)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {
            "channel": "imu",
            "axis": "xyz"[self.axis],
            "quantity": "angular_rate",
            "felt": "xyz"[self.felt],
        }
        return {"where": where, "parameters": {"sensitivity": quantity(self.sensitivity, "s/m")}}

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        rate = readings.rate.copy()
        rate[:, self.axis] += self.sensitivity * readings.specific_force[:, self.felt]
        return replace(readings, rate=rate)
