"""A car on its springs: a large part of the body that moves along all three axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.inertia import is_body, take_away
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Array, Body, Plan, Scene

SLENDER = 1.05  # by so much two principal moments must exceed the third


@dataclass(frozen=True)
class SprungCar(Effect):
    """A body of its own inertia on springs along the three body axes; it turns with the body.

    The truth's mass, centre and inertia hold it at its place, where it is while the body hangs level.
    """

    name = "sprung_mass"
    form = True
    mechanical = True
    aside = True
    mass: float  # kg
    frequency: Array  # (3,) Hz, along x, y, z
    damping_ratio: float  # 1
    position: Array  # (3,) m, body, of its centre of mass
    inertia: Array  # (3,) kg m^2, principal, along the body axes

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> SprungCar:
        """Up to a third of the body."""
        body = scene.body
        mass = log_size(size, 0.02, 1.0 / 3.0) * body.mass
        frequency = 1.2 * 5.0 ** rng.uniform(size=3)
        damping = log_size(float(rng.uniform()), 0.02, 0.15)
        span = scene.geometry.hinge[:, :2].max(axis=0)
        away = rng.uniform(-0.3, 0.3, 3) * [*np.maximum(span, 0.5), 1.0]
        inertia = rng.uniform(0.3, 0.8, 3) * mass / body.mass * np.diag(body.inertia)
        return cls(mass, frequency, damping, body.center_of_mass + away, inertia).fitting(body)

    def fitting(self, body: Body) -> SprungCar:
        """The same, nearer to the centre of mass and smaller until what is left is a body too."""
        place, inertia = self.position, self._possible(self.inertia)
        while not is_body(self._without(body, place, inertia)):
            place = body.center_of_mass + 0.8 * (place - body.center_of_mass)
            inertia = 0.8 * inertia
        return SprungCar(self.mass, self.frequency, self.damping_ratio, np.round(place, 4), inertia)

    @staticmethod
    def _possible(inertia: Array) -> Array:
        """Principal moments of a body: none above the sum of the two others."""
        return np.minimum(inertia, (np.sum(inertia) - inertia) / SLENDER)

    def _without(self, body: Body, place: Array, inertia: Array) -> Body:
        return take_away(body, Body(self.mass, place, np.diag(inertia)))

    def truth(self) -> dict[str, Any]:
        """``frequency`` is the lowest of the three."""
        parameters = {
            "mass": quantity(self.mass, "kg"),
            "frequency": quantity(float(np.min(self.frequency)), "Hz"),
            "damping_ratio": quantity(self.damping_ratio, "1"),
        }
        for axis, value in zip("xyz", self.frequency, strict=True):
            parameters[f"frequency_{axis}"] = quantity(value, "Hz")
        where = {"position": self.position.tolist(), "inertia": self.inertia.tolist()}
        return {"where": where, "parameters": parameters}

    def rigid_part(self, body: Body) -> Body:
        """See :class:`Effect`."""
        return self._without(body, self.position, self.inertia)

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        part = spec.body("body").add_body(name="sprung", pos=self.position)
        give_mass(part, self.mass, np.zeros(3), np.diag(self.inertia))
        for axis, circular in enumerate(2.0 * np.pi * self.frequency):
            part.add_joint(
                name=f"sprung_{axis}",
                type=mujoco.mjtJoint.mjJNT_SLIDE,
                axis=np.eye(3)[axis],
                stiffness=self.mass * circular**2,
                damping=2.0 * self.damping_ratio * circular * self.mass,
                # Upright springs are set so that the mass is at its place when the body hangs level.
                springref=scene.rig.gravity / circular**2 if axis == 2 else 0.0,
            )

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        circular = 2.0 * np.pi * self.frequency
        part = Body(self.mass, np.zeros(3), np.diag(self.inertia))
        sag = np.array([0.0, 0.0, scene.rig.gravity / circular[2] ** 2])
        made.spring_part(
            part,
            self.position,
            self.mass * circular**2,
            2.0 * self.damping_ratio * circular * self.mass,
            sag,
        )
