"""Something slides and hits its stops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.place import tank
from bench.concealed.inertia import add_point
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Array, Body, Plan, Scene


@dataclass(frozen=True)
class LooseMass(Effect):
    """A mass that slides along one body axis with little friction between two stops."""

    name = "loose_mass"
    mechanical = True
    aside = True
    mass: float  # kg
    travel: float  # m, each way
    friction: float  # 1, of its weight
    position: Array  # (3,) m, body
    axis: int

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> LooseMass:
        """A toolbox in the boot, at the strong end."""
        mass = log_size(size, 0.0005, 0.03) * scene.body.mass
        travel = rng.uniform(0.005, 0.04)
        return cls(mass, travel, rng.uniform(0.003, 0.01), tank(rng, scene), int(rng.integers(2)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "mass": quantity(self.mass, "kg"),
            "travel": quantity(self.travel, "m"),
            "friction": quantity(self.friction, "1"),
        }
        where = {"position": self.position.tolist(), "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": parameters}

    def rigid_part(self, body: Body) -> Body:
        """See :class:`Effect`."""
        return add_point(body, -self.mass, self.position)

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        part = spec.body("body").add_body(name="loose", pos=self.position)
        give_mass(part, self.mass, np.zeros(3), 1e-9 * np.eye(3))
        part.add_joint(
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=np.eye(3)[self.axis],
            limited=True,
            range=[-self.travel, self.travel],
            solref_limit=[0.004, 0.5],
            # Viscous, not dry: a body at rest must have one place to be.
            damping=self.friction * self.mass * scene.rig.gravity / 0.05,
        )
