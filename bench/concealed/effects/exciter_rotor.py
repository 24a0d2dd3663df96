"""The exciter's moving mass is not negligible."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Array, Plan, Scene


@dataclass(frozen=True)
class ExciterRotor(Effect):
    """A point mass at the exciter's origin that the force cells do not see and the scale did not weigh.

    The truth's mass, centre and inertia do not count it.
    """

    name = "exciter_rotor"
    mechanical = True
    rotor_mass: float  # kg
    position: Array  # (3,) m, body

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ExciterRotor:
        """From three doubts of the scale up."""
        return cls(log_size(size, 2.0, 50.0), scene.devices.exciter_position)

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> ExciterRotor:
        """Up to 30 kg; a light body carries a light exciter."""
        return cls(log_size(size, 2.0, min(30.0, 0.1 * scene.body.mass)), scene.devices.exciter_position)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {"rotor_mass": quantity(self.rotor_mass, "kg")}
        return {"where": {"channel": "exciter"}, "parameters": parameters}

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        rotor = spec.body("body").add_body(name="rotor", pos=self.position)
        give_mass(rotor, self.rotor_mass, np.zeros(3), 1e-9 * np.eye(3))

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        made.carry(self.rotor_mass, self.position)
