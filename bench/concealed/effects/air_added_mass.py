"""Entrained air: inertia without weight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Plan, Scene


@dataclass(frozen=True)
class AirAddedMass(Effect):
    """A point mass at the centre of mass that gravity does not pull; the truth's mass does not count it."""

    name = "air_added_mass"
    mechanical = True
    added_mass: float  # kg

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> AirAddedMass:
        """In proportion to the body."""
        return cls(log_size(size, 0.001, 0.06) * scene.body.mass)

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> AirAddedMass:
        """Up to 30 kg; a light body takes less air along."""
        return cls(log_size(size, 1.0, min(30.0, 0.08 * scene.body.mass)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"parameters": {"added_mass": quantity(self.added_mass, "kg")}}

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        air = spec.body("body").add_body(name="air", pos=scene.body.center_of_mass, gravcomp=1.0)
        give_mass(air, self.added_mass, np.zeros(3), 1e-9 * np.eye(3))

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        made.carry(self.added_mass, scene.body.center_of_mass, weighs=False)
