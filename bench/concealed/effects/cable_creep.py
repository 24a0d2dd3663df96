"""Outside the table: one cable creeps longer while it is measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity
from bench.concealed.effects.place import random_cable
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class CableCreep(Effect):
    """Length grows by a (1 - exp(-t / tau)) after every release; as described in statics."""

    name = "cable_creep"
    outside = True
    near = ("cable_length",)
    mechanical = True
    cable: int
    length: float  # m, at the release
    growth: float  # m, in the end
    time_constant: float  # s

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableCreep:
        """From a tenth of a millimetre."""
        cable = random_cable(rng, scene)
        length = float(scene.geometry.length[cable])
        return cls(cable, length, log_size(size, 0.0002, 0.01), rng.uniform(5.0, 30.0))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "growth": quantity(self.growth, "m"),
            "time_constant": quantity(self.time_constant, "s"),
        }
        return {"where": {"channel": f"cable_{self.cable + 1}"}, "parameters": parameters}

    def drive(self, model: Any, data: Any, state: State) -> None:
        """See :class:`Effect`."""
        grown = self.growth * (1.0 - np.exp(-max(state.time, 0.0) / self.time_constant))
        model.eq_data[self.cable, 0] = self.length + grown - model.tendon_length0[self.cable]
