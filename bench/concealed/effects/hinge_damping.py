"""A viscous moment in the cables' hinges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.hinge import HingeMoments
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class HingeDamping(Effect):
    """At both hinges of every cable, against the relative rotation there; a cable spins at half the twist."""

    name = "hinge_damping"
    mechanical = True
    damping: float  # N m s/rad, each hinge

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> HingeDamping:
        """From a greased bearing to a rubber bush."""
        return cls(log_size(size, 0.1, 40.0))

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> HingeDamping:
        """Up to a rubber bush of 50 N m s/rad."""
        return cls(log_size(size, 0.3, 50.0))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"parameters": {"damping": quantity(self.damping, "N*m*s/rad")}}

    def bind(self, scene: Scene) -> HingeMoments:
        """See :class:`Effect`."""
        return HingeMoments(scene.geometry, lambda rate: -self.damping * rate)
