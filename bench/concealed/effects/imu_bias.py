"""A constant offset of one gyroscope or accelerometer axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class ImuBias(Effect):
    """The axis' ordinary bias is replaced by this one."""

    name = "imu_bias"
    measured: str  # "angular_rate" or "specific_force"
    axis: int
    value: float  # rad/s or m/s^2

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ImuBias:
        """Beyond 3.5 of the default tolerances."""
        kind = str(rng.choice(["angular_rate", "specific_force"]))
        faint, strong = (0.0035, 0.03) if kind == "angular_rate" else (0.07, 0.5)
        return cls(kind, int(rng.integers(3)), signed(rng, log_size(size, faint, strong)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        unit = "rad/s" if self.measured == "angular_rate" else "m/s^2"
        where = {"channel": "imu", "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": {self.measured: quantity(self.value, unit)}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        field = "rate_bias" if self.measured == "angular_rate" else "acceleration_bias"
        changed: dict[str, Any] = {field: with_entry(getattr(scene.errors, field), self.axis, self.value)}
        return replace(scene, errors=replace(scene.errors, **changed))
