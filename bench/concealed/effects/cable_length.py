"""One cable is longer than described."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import random_cable, with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class CableLength(Effect):
    """True length: the described one and ``error``."""

    name = "cable_length"
    mechanical = True
    cable: int
    error: float  # m

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableLength:
        """Beyond 3.5 of the default tolerances."""
        return cls(random_cable(rng, scene), signed(rng, log_size(size, 0.002, 0.03)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": f"cable_{self.cable + 1}"}
        return {"where": where, "parameters": {"error": quantity(self.error, "m")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        length = scene.rig.cables[self.cable].length + self.error
        changed = with_entry(scene.geometry.length, self.cable, length)
        return replace(scene, geometry=replace(scene.geometry, length=changed))
