"""A zero error of one inclinometer axis."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class InclinometerOffset(Effect):
    """Added to what the axis reads; how the device is mounted stays as it was."""

    name = "inclinometer_offset"
    axis: int
    offset: float  # rad

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> InclinometerOffset:
        """Beyond 3.5 of the default tolerances of its mount."""
        return cls(int(rng.integers(2)), signed(rng, log_size(size, 0.0012, 0.02)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": "inclinometer", "axis": "xy"[self.axis]}
        return {"where": where, "parameters": {"offset": quantity(self.offset, "rad")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        zero = with_entry(scene.errors.inclination_zero, self.axis, self.offset)
        return replace(scene, errors=replace(scene.errors, inclination_zero=zero))
