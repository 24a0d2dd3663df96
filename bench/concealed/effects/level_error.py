"""The ceiling points are tilted against the vertical."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class LevelError(Effect):
    """True ceiling points: the described ones turned by ``angle`` about a horizontal world axis."""

    name = "level_error"
    mechanical = True
    axis: int
    angle: float  # rad

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> LevelError:
        """Beyond 3.5 of the default tolerances."""
        return cls(int(rng.integers(2)), signed(rng, log_size(size, 0.002, 0.03)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "ceiling", "axis": "xy"[self.axis]}
        return {"where": where, "parameters": {"angle": quantity(self.angle, "rad")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        flat = Rotation.from_rotvec(scene.level).inv().apply(scene.geometry.ceiling)
        level = with_entry(scene.level, self.axis, self.angle)
        ceiling = Rotation.from_rotvec(level).apply(flat)
        return replace(scene, level=level, geometry=replace(scene.geometry, ceiling=ceiling))
