"""The inertial unit is turned against its description."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class ImuMisalignment(Effect):
    """True orientation: the described one, then turned by ``angle`` about one of the unit's own axes."""

    name = "imu_misalignment"
    axis: int
    angle: float  # rad

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ImuMisalignment:
        """Beyond 3.5 of the default tolerances."""
        return cls(int(rng.integers(3)), signed(rng, log_size(size, 0.0035, 0.05)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "imu", "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": {"angle": quantity(self.angle, "rad")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        assert scene.rig.imu is not None
        described = Rotation.from_quat(scene.rig.imu.orientation)
        ordinary = (described.inv() * Rotation.from_matrix(scene.devices.imu_rotation)).as_rotvec()
        turned = described * Rotation.from_rotvec(with_entry(ordinary, self.axis, self.angle))
        return replace(scene, devices=replace(scene.devices, imu_rotation=turned.as_matrix()))
