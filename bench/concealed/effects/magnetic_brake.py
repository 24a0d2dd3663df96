"""Outside the table: an eddy-current brake near one point of the room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity
from bench.concealed.effects.place import hanging, tank
from bench.concealed.scene import Array, Scene


@dataclass(frozen=True)
class MagneticBrake(Effect):
    """Force -c v exp(-d^2 / 2 s^2) on a body point, d from where it is while the body hangs at rest."""

    name = "magnetic_brake"
    outside = True
    mechanical = True
    damping: float  # N s/m
    width: float  # m
    position: Array  # (3,) m, body
    home: Array  # (3,) m, world

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> MagneticBrake:
        """From a fridge magnet to a real brake, in proportion to the body."""
        place = tank(rng, scene)
        damping = log_size(size, 0.005, 0.6) * scene.body.mass
        return cls(damping, rng.uniform(0.015, 0.04), place, hanging(scene, place))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {"damping": quantity(self.damping, "N*s/m"), "width": quantity(self.width, "m")}
        return {
            "where": {"position": self.position.tolist(), "home": self.home.tolist()},
            "parameters": parameters,
        }

    def force(self, state: State) -> Array:
        """See :class:`Effect`."""
        place, velocity = state.point(self.position)
        away = place - self.home
        share = np.exp(-0.5 * (away @ away) / self.width**2)
        return state.wrench_at(self.position, -self.damping * share * velocity)
