"""A force against the square of speed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity
from bench.concealed.scene import Array, Scene

AIR = 1.2  # kg/m^3


@dataclass(frozen=True)
class AirDrag(Effect):
    """Half rho Cd A v^2 at the centre of mass, against its velocity."""

    name = "air_drag"
    mechanical = True
    drag_area: float  # m^2
    center_of_mass: Array

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> AirDrag:
        """Speeds are decimetres a second: only large areas are felt."""
        return cls(log_size(size, 2.0, 60.0), scene.body.center_of_mass)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"parameters": {"drag_area": quantity(self.drag_area, "m^2")}}

    def force(self, state: State) -> Array:
        """See :class:`Effect`."""
        _, velocity = state.point(self.center_of_mass)
        force = -0.5 * AIR * self.drag_area * np.sqrt(velocity @ velocity) * velocity
        return state.wrench_at(self.center_of_mass, force)
