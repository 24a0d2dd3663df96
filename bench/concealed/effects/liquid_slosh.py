"""Liquid swings in a tank."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.place import tank
from bench.concealed.inertia import add_point, is_body
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Array, Body, Plan, Scene


@dataclass(frozen=True)
class LiquidSlosh(Effect):
    """A pendulum in the body; the truth's inertia holds its mass at its rest, the body level."""

    name = "liquid_slosh"
    mechanical = True
    aside = True
    mass: float  # kg
    frequency: float  # Hz
    damping_ratio: float  # 1
    position: Array  # (3,) m, body, of the liquid at rest

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> LiquidSlosh:
        """A tank low in the body."""
        place = tank(rng, scene)
        mass = log_size(size, 0.0005, 0.05) * scene.body.mass
        damping = float(np.exp(rng.uniform(np.log(0.005), np.log(0.05))))
        return cls(mass, rng.uniform(0.5, 1.6), damping, place)

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> LiquidSlosh:
        """From 5 to 100 kg, a quarter of the body at most."""
        mass = log_size(size, 5.0, min(100.0, 0.25 * scene.body.mass))
        damping = log_size(float(rng.uniform()), 0.005, 0.08)
        place, middle = tank(rng, scene), scene.body.center_of_mass
        while not is_body(add_point(scene.body, -mass, place)):
            place = np.round(middle + 0.8 * (place - middle), 3)
        return cls(mass, rng.uniform(0.5, 1.6), damping, place)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "mass": quantity(self.mass, "kg"),
            "frequency": quantity(self.frequency, "Hz"),
            "damping_ratio": quantity(self.damping_ratio, "1"),
        }
        return {"where": {"position": self.position.tolist()}, "parameters": parameters}

    def rigid_part(self, body: Body) -> Body:
        """See :class:`Effect`."""
        return add_point(body, -self.mass, self.position)

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        circular = 2.0 * np.pi * self.frequency
        length = scene.rig.gravity / circular**2
        bob = spec.body("body").add_body(name="liquid", pos=self.position + np.array([0.0, 0.0, length]))
        give_mass(bob, self.mass, np.array([0.0, 0.0, -length]), 1e-9 * np.eye(3))
        damping = 2.0 * self.damping_ratio * circular * self.mass * length**2
        for axis in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]):
            bob.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, damping=damping)

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        circular = 2.0 * np.pi * self.frequency
        length = scene.rig.gravity / circular**2
        origin, rotation = made.pose
        bob = made.add_bob(self.mass, origin + rotation @ self.position)
        made.hang(bob, self.position + np.array([0.0, 0.0, length]), length)
        # A damper at the pivot, as one between the liquid and the tank's point where it rests
        tank_point = made.point(made.body, self.position)
        made.damp(bob, tank_point, 2.0 * self.damping_ratio * circular * self.mass)
