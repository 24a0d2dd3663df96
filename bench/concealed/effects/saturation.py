"""Outside the table: one gyroscope axis clips."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Samples, Trajectory


@dataclass(frozen=True)
class Saturation(Effect):
    """The axis reads no more than a limit either way: a share of what the first run would have shown."""

    name = "saturation"
    outside = True
    axis: int
    limit: float  # rad/s

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> Saturation:
        """An axis that moves; the limit follows from how fast the body can turn."""
        return cls(int(rng.integers(2)), log_size(size, 0.06, 0.012))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "imu", "axis": "xyz"[self.axis], "quantity": "angular_rate"}
        return {"where": where, "parameters": {"limit": quantity(self.limit, "rad/s")}}

    def corrupt(self, device: str, samples: Samples, scene: Scene, plan: Plan) -> Samples:
        """See :class:`Effect`."""
        if device != "imu":
            return samples
        values = samples.values.copy()
        values[:, self.axis] = np.clip(values[:, self.axis], -self.limit, self.limit)
        return replace(samples, values=values)

    def observe(self, scene: Scene, paths: Sequence[Trajectory]) -> dict[str, Any] | None:
        """See :class:`Effect`: nothing is clipped unless the axis turns faster than the limit."""
        clipped = [np.abs(p.rate @ scene.devices.imu_rotation)[:, self.axis] > self.limit for p in paths]
        return {} if np.mean(clipped[2]) > 0.02 else None

    def stronger(self) -> Effect:
        """See :class:`Effect`."""
        return replace(self, limit=0.6 * self.limit)
