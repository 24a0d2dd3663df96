"""Outside the table: cables resist being twisted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity
from bench.concealed.scene import Array, Scene


@dataclass(frozen=True)
class CableTorsion(Effect):
    """Moment -k (theta . u) u of every cable u on the body, theta its rotation vector from level."""

    name = "cable_torsion"
    outside = True
    mechanical = True
    torsion_stiffness: float  # N m/rad, each cable
    ceiling_points: Array
    hinges: Array

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableTorsion:
        """In proportion to the body's weight."""
        stiffness = log_size(size, 0.0005, 0.05) * scene.body.mass * scene.rig.gravity
        return cls(stiffness, scene.geometry.ceiling, scene.geometry.hinge)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"parameters": {"torsion_stiffness": quantity(self.torsion_stiffness, "N*m/rad")}}

    def force(self, state: State) -> Array:
        """See :class:`Effect`."""
        r = state.rotation
        # First order of the rotation vector: angles here are a tenth of a radian.
        twist = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        span = state.position + self.hinges @ r.T - self.ceiling_points
        along = span / np.sqrt((span * span).sum(axis=1))[:, None]
        moment = -self.torsion_stiffness * ((along @ twist) @ along)
        return np.concatenate([np.zeros(3), r.T @ moment])
