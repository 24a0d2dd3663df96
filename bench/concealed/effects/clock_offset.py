"""One device's clock is late or early against the others."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class ClockOffset(Effect):
    """Stamps of one device are ``offset`` later than the truth."""

    name = "clock_offset"
    device: str  # "imu", "inclinometer", "exciter"
    offset: float  # s

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ClockOffset:
        """Beyond 3.5 of the default tolerances."""
        device = str(rng.choice(["imu", "inclinometer", "exciter"]))
        faint = 0.002 if device != "inclinometer" else 0.006
        return cls(device, signed(rng, log_size(size, faint, 0.03)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"where": {"channel": self.device}, "parameters": {"offset": quantity(self.offset, "s")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        clock = {**scene.errors.clock, self.device: self.offset}
        return replace(scene, errors=replace(scene.errors, clock=clock))
