"""A scale error of one gyroscope or accelerometer axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class ImuScale(Effect):
    """The axis' ordinary scale error is replaced by this one."""

    name = "imu_scale"
    measured: str  # "angular_rate" or "specific_force"
    axis: int
    scale: float  # 1

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ImuScale:
        """Beyond 3.5 of the default tolerances."""
        kind = str(rng.choice(["angular_rate", "specific_force"]))
        return cls(kind, int(rng.integers(3)), signed(rng, log_size(size, 0.0035, 0.04)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "imu", "axis": "xyz"[self.axis], "quantity": self.measured}
        return {"where": where, "parameters": {"scale": quantity(self.scale, "1")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        field = "rate_scale" if self.measured == "angular_rate" else "acceleration_scale"
        changed: dict[str, Any] = {field: with_entry(getattr(scene.errors, field), self.axis, self.scale)}
        return replace(scene, errors=replace(scene.errors, **changed))
