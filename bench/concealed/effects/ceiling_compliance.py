"""The ceiling yields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class CeilingCompliance(Effect):
    """All ceiling points on one heavy plate, on a spring along one world axis.

    Described is the unloaded ceiling: along z the plate hangs lower under the body's weight.
    """

    name = "ceiling_compliance"
    mechanical = True
    aside = True
    axis: int
    stiffness: float  # N/m
    mass: float  # kg
    damping_ratio: float  # 1

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CeilingCompliance:
        """From a stiff crane hall to a wooden beam."""
        mass = scene.body.mass * rng.uniform(0.05, 0.5)
        return cls(int(rng.integers(3)), log_size(size, 3e7, 3e5), mass, rng.uniform(0.005, 0.05))

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> CeilingCompliance:
        """Down to 0.3 MN/m."""
        mass = scene.body.mass * rng.uniform(0.05, 0.5)
        return cls(int(rng.integers(3)), log_size(size, 1e7, 3e5), mass, rng.uniform(0.005, 0.05))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "stiffness": quantity(self.stiffness, "N/m"),
            "mass": quantity(self.mass, "kg"),
            "damping_ratio": quantity(self.damping_ratio, "1"),
        }
        return {"where": {"channel": "ceiling", "axis": "xyz"[self.axis]}, "parameters": parameters}

    def ceiling(self, spec: Any, scene: Scene) -> Any:
        """See :class:`Effect`."""
        plate = spec.worldbody.add_body(name="plate")
        give_mass(plate, self.mass, np.zeros(3), np.eye(3))
        # Its own weight is part of the unloaded ceiling.
        plate.gravcomp = 1.0
        plate.add_joint(
            name="plate",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=np.eye(3)[self.axis],
            stiffness=self.stiffness,
            damping=2.0 * self.damping_ratio * np.sqrt(self.stiffness * self.mass),
        )
        return plate

    def fastest(self, scene: Scene) -> float:
        """Of the plate by itself."""
        return float(np.sqrt(self.stiffness / self.mass))

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        made.slide_ceiling(
            self.mass,
            self.axis,
            self.stiffness,
            2.0 * self.damping_ratio * np.sqrt(self.stiffness * self.mass),
        )
