"""A Coulomb moment in the cables' hinges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.hinge import HingeMoments
from bench.concealed.scene import Array, Scene

SOFT = 5e-4  # rad/s: below it the moment grows with the rate, so that the sign does not chatter


@dataclass(frozen=True)
class HingeFriction(Effect):
    """At both hinges of every cable, of fixed size against the relative rotation there."""

    name = "hinge_friction"
    mechanical = True
    torque: float  # N m, each hinge

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> HingeFriction:
        """In proportion to the body's weight: friction is."""
        return cls(log_size(size, 1e-5, 1.5e-3) * scene.body.mass * scene.rig.gravity)

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> HingeFriction:
        """Up to 20 N m; a light body rests in less."""
        return cls(log_size(size, 0.1, min(20.0, 3e-3 * scene.body.mass * scene.rig.gravity)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"parameters": {"torque": quantity(self.torque, "N*m")}}

    def bind(self, scene: Scene) -> HingeMoments:
        """See :class:`Effect`."""

        def law(rate: Array) -> Array:
            speed = np.linalg.norm(rate, axis=1, keepdims=True)
            return np.asarray(-self.torque * rate / np.sqrt(speed**2 + SOFT**2))

        return HingeMoments(scene.geometry, law)
