"""A zero error of one load cell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import random_cable, with_entry
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class LoadCellOffset(Effect):
    """The cell's ordinary zero error is replaced by this one."""

    name = "load_cell_offset"
    cable: int
    offset: float  # N

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> LoadCellOffset:
        """Beyond 3.5 of the default tolerances."""
        return cls(random_cable(rng, scene), signed(rng, log_size(size, 11.0, 200.0)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": f"cable_{self.cable + 1}"}
        return {"where": where, "parameters": {"offset": quantity(self.offset, "N")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        zero = with_entry(scene.errors.tension_zero, self.cable, self.offset)
        return replace(scene, errors=replace(scene.errors, tension_zero=zero))
