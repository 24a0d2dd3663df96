"""Outside the table: a spring that hardens with the cube of displacement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity
from bench.concealed.effects.place import hanging, tank
from bench.concealed.scene import Array, Scene


@dataclass(frozen=True)
class HardeningTether(Effect):
    """Force -k d^3 along one world axis, d from where the point is while the body hangs at rest."""

    name = "hardening_tether"
    outside = True
    near = ("tether",)
    mechanical = True
    cubic_stiffness: float  # N/m^3
    position: Array  # (3,) m, body
    home: Array  # (3,) m, world
    axis: int

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> HardeningTether:
        """Sized by its force at 2 cm."""
        place = tank(rng, scene)
        force = log_size(size, 0.0003, 0.03) * scene.body.mass * scene.rig.gravity
        return cls(force / 0.02**3, place, hanging(scene, place), int(rng.integers(2)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"position": self.position.tolist(), "axis": "xyz"[self.axis], "home": self.home.tolist()}
        return {"where": where, "parameters": {"cubic_stiffness": quantity(self.cubic_stiffness, "N/m^3")}}

    def force(self, state: State) -> Array:
        """See :class:`Effect`."""
        place, _ = state.point(self.position)
        force = np.zeros(3)
        force[self.axis] = -self.cubic_stiffness * (place - self.home)[self.axis] ** 3
        return state.wrench_at(self.position, force)
