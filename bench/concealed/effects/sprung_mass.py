"""Part of the body moves on springs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.place import tank
from bench.concealed.effects.sprung_car import SprungCar
from bench.concealed.inertia import add_point
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Array, Body, Plan, Scene


@dataclass(frozen=True)
class SprungMass(Effect):
    """A mass that slides along one body axis between springs; the truth's inertia holds it at its rest."""

    name = "sprung_mass"
    mechanical = True
    lab_form = SprungCar
    aside = True
    mass: float  # kg
    frequency: float  # Hz
    damping_ratio: float  # 1
    position: Array  # (3,) m, body
    axis: int

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> SprungMass:
        """An engine on its mounts, at the strong end."""
        mass = log_size(size, 0.001, 0.08) * scene.body.mass
        damping = float(np.exp(rng.uniform(np.log(0.005), np.log(0.08))))
        return cls(mass, rng.uniform(1.5, 7.0), damping, tank(rng, scene), int(rng.integers(3)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "mass": quantity(self.mass, "kg"),
            "frequency": quantity(self.frequency, "Hz"),
            "damping_ratio": quantity(self.damping_ratio, "1"),
        }
        where = {"position": self.position.tolist(), "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": parameters}

    def rigid_part(self, body: Body) -> Body:
        """See :class:`Effect`."""
        return add_point(body, -self.mass, self.position)

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        circular = 2.0 * np.pi * self.frequency
        part = spec.body("body").add_body(name="sprung", pos=self.position)
        give_mass(part, self.mass, np.zeros(3), 1e-9 * np.eye(3))
        # Upright springs are set so that the mass is at its place when the body hangs level.
        set_by = scene.rig.gravity / circular**2 if self.axis == 2 else 0.0
        part.add_joint(
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=np.eye(3)[self.axis],
            stiffness=self.mass * circular**2,
            damping=2.0 * self.damping_ratio * circular * self.mass,
            springref=set_by,
        )
