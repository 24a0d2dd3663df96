"""Outside the table: one load cell feels its neighbour."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Readings


@dataclass(frozen=True)
class CellCrosstalk(Effect):
    """Reading T_i + c (T_j - weight / n)."""

    name = "cell_crosstalk"
    outside = True
    near = ("load_cell_gain", "load_cell_offset")
    cable: int
    neighbour: int
    share: float  # 1

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CellCrosstalk:
        """From a fifth of a percent."""
        cable, neighbour = rng.choice(len(scene.geometry.length), 2, replace=False)
        return cls(int(cable), int(neighbour), signed(rng, log_size(size, 0.003, 0.08)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": f"cable_{self.cable + 1}", "neighbour": f"cable_{self.neighbour + 1}"}
        return {"where": where, "parameters": {"share": quantity(self.share, "1")}}

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        even = scene.body.mass * scene.rig.gravity / len(scene.geometry.length)
        tension = readings.tension.copy()
        tension[:, self.cable] += self.share * (tension[:, self.neighbour] - even)
        return replace(readings, tension=tension)
