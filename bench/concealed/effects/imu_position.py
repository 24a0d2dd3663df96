"""The inertial unit sits elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class ImuPosition(Effect):
    """True position: the described one and ``error`` along one body axis."""

    name = "imu_position"
    axis: int
    error: float  # m

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ImuPosition:
        """Beyond 3.5 of the default tolerances."""
        return cls(int(rng.integers(3)), signed(rng, log_size(size, 0.004, 0.08)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "imu", "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": {"error": quantity(self.error, "m")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        assert scene.rig.imu is not None
        value = scene.rig.imu.position[self.axis] + self.error
        place = with_entry(scene.devices.imu_position, self.axis, value)
        return replace(scene, devices=replace(scene.devices, imu_position=place))
