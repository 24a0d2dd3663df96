"""Outside the table: one hinge alone sticks and slips."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.hinge import HingeMoments
from bench.concealed.effects.place import random_cable
from bench.concealed.scene import Array, Scene

SOFT = 5e-4  # rad/s


@dataclass(frozen=True)
class StickSlip(Effect):
    """Friction at one body hinge that falls with speed: static moment, lower sliding moment (Stribeck)."""

    name = "stick_slip"
    outside = True
    near = ("hinge_friction",)
    mechanical = True
    cable: int
    static_torque: float  # N m
    sliding_torque: float  # N m
    stribeck_rate: float  # rad/s

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> StickSlip:
        """In proportion to the body's weight."""
        torque = log_size(size, 1e-4, 6e-3) * scene.body.mass * scene.rig.gravity
        return cls(random_cable(rng, scene), torque, rng.uniform(0.3, 0.6) * torque, rng.uniform(0.01, 0.05))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "static_torque": quantity(self.static_torque, "N*m"),
            "sliding_torque": quantity(self.sliding_torque, "N*m"),
            "stribeck_rate": quantity(self.stribeck_rate, "rad/s"),
        }
        return {"where": {"channel": f"cable_{self.cable + 1}", "end": "body"}, "parameters": parameters}

    def bind(self, scene: Scene) -> HingeMoments:
        """See :class:`Effect`."""

        def law(rate: Array) -> Array:
            speed = np.linalg.norm(rate[self.cable])
            extra = self.static_torque - self.sliding_torque
            torque = self.sliding_torque + extra * np.exp(-((speed / self.stribeck_rate) ** 2))
            out = np.zeros_like(rate)
            out[self.cable] = -torque * rate[self.cable] / np.sqrt(speed**2 + SOFT**2)
            return out

        return HingeMoments(scene.geometry, law, at_ceiling=False)
