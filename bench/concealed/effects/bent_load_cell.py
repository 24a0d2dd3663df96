"""Outside the table: the amplifier of one load cell is not straight."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import random_cable
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Readings


@dataclass(frozen=True)
class BentLoadCell(Effect):
    """Reading T + q (T - w)^2 / w, w an even share of the weight."""

    name = "bent_load_cell"
    outside = True
    near = ("load_cell_gain", "load_cell_offset")
    cable: int
    curvature: float  # 1

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> BentLoadCell:
        """From a tenth of a percent."""
        return cls(random_cable(rng, scene), signed(rng, log_size(size, 0.005, 0.3)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": f"cable_{self.cable + 1}"}
        return {"where": where, "parameters": {"curvature": quantity(self.curvature, "1")}}

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        share = scene.body.mass * scene.rig.gravity / len(scene.geometry.length)
        tension = readings.tension.copy()
        tension[:, self.cable] += self.curvature * (tension[:, self.cable] - share) ** 2 / share
        return replace(readings, tension=tension)
