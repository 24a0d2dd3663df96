"""Outside the table: a load cell warms up and its zero drifts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import random_cable
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Readings


@dataclass(frozen=True)
class ThermalDrift(Effect):
    """Offset a (1 - exp(-t / tau)) in every recording, t from its release."""

    name = "thermal_drift"
    outside = True
    near = ("load_cell_offset",)
    cable: int
    drift: float  # N, in the end
    time_constant: float  # s

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ThermalDrift:
        """From a few newtons."""
        drift = signed(rng, log_size(size, 3.0, 80.0))
        return cls(random_cable(rng, scene), drift, rng.uniform(5.0, 30.0))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {"drift": quantity(self.drift, "N"), "time_constant": quantity(self.time_constant, "s")}
        return {"where": {"channel": f"cable_{self.cable + 1}"}, "parameters": parameters}

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        tension = readings.tension.copy()
        tension[:, self.cable] += self.drift * (1.0 - np.exp(-readings.time / self.time_constant))
        return replace(readings, tension=tension)
