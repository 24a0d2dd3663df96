"""Outside the table: one accelerometer axis has lost its fine bits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Samples


@dataclass(frozen=True)
class CoarseSteps(Effect):
    """The axis reads whole multiples of a step."""

    name = "coarse_steps"
    outside = True
    axis: int
    step: float  # m/s^2

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CoarseSteps:
        """From four times the noise."""
        return cls(int(rng.integers(3)), log_size(size, 0.04, 0.6))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "imu", "axis": "xyz"[self.axis], "quantity": "specific_force"}
        return {"where": where, "parameters": {"step": quantity(self.step, "m/s^2")}}

    def corrupt(self, device: str, samples: Samples, scene: Scene, plan: Plan) -> Samples:
        """See :class:`Effect`."""
        if device != "imu":
            return samples
        values = samples.values.copy()
        values[:, 3 + self.axis] = self.step * np.round(values[:, 3 + self.axis] / self.step)
        return replace(samples, values=values)
