"""A scale error of one load cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import random_cable, with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class LoadCellGain(Effect):
    """The cell's ordinary gain error is replaced by this one."""

    name = "load_cell_gain"
    cable: int
    gain: float  # 1: 0.01 reads 1 % high

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> LoadCellGain:
        """Beyond 3.5 of the default tolerances."""
        return cls(random_cable(rng, scene), signed(rng, log_size(size, 0.0018, 0.03)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": f"cable_{self.cable + 1}"}
        return {"where": where, "parameters": {"gain": quantity(self.gain, "1")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        gain = with_entry(scene.errors.tension_gain, self.cable, 1.0 + self.gain)
        return replace(scene, errors=replace(scene.errors, tension_gain=gain))
