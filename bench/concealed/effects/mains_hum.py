"""Outside the table: the mains hum in the load cells."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.scene import Array, Plan, Scene
from bench.concealed.signals import Readings


@dataclass(frozen=True)
class MainsHum(Effect):
    """A sine near 50 Hz, of its own size and phase in every cell."""

    name = "mains_hum"
    outside = True
    amplitude: Array  # (cables,) N
    phase: Array  # (cables,) rad
    frequency: float  # Hz

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> MainsHum:
        """From half the noise."""
        n = len(scene.geometry.length)
        amplitude = log_size(size, 1.0, 30.0) * rng.uniform(0.4, 1.6, n)
        return cls(amplitude, rng.uniform(0.0, 2.0 * np.pi, n), 50.0 + rng.normal(0.0, 0.02))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        largest = int(np.argmax(self.amplitude))
        parameters = {
            "amplitude": quantity(self.amplitude[largest], "N"),
            "frequency": quantity(self.frequency, "Hz"),
        }
        return {"where": {"channel": f"cable_{largest + 1}"}, "parameters": parameters}

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        angle = 2.0 * np.pi * self.frequency * readings.time[:, None] + self.phase
        return replace(readings, tension=readings.tension + self.amplitude * np.sin(angle))
