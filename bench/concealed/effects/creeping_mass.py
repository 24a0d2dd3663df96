"""Outside the table: a mass creeps through the body while it is measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity, signed
from bench.concealed.effects.place import tank
from bench.concealed.inertia import add_point
from bench.concealed.mechanism import give_mass
from bench.concealed.scene import Array, Body, Plan, Scene


@dataclass(frozen=True)
class CreepingMass(Effect):
    """A mass on a carriage that moves evenly along one body axis during each run; at its start in statics."""

    name = "creeping_mass"
    outside = True
    near = ("loose_mass",)
    mechanical = True
    mass: float  # kg
    speed: float  # m/s
    position: Array  # (3,) m, body, at the release
    axis: int

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CreepingMass:
        """Up to a few percent of the body, decimetres a run."""
        mass = log_size(size, 0.0005, 0.02) * scene.body.mass
        speed = signed(rng, rng.uniform(0.15, 0.5) / scene.plans[-1].duration)
        return cls(mass, speed, tank(rng, scene), int(rng.integers(2)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {"mass": quantity(self.mass, "kg"), "speed": quantity(self.speed, "m/s")}
        where = {"position": self.position.tolist(), "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": parameters}

    def rigid_part(self, body: Body) -> Body:
        """See :class:`Effect`."""
        return add_point(body, -self.mass, self.position)

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        part = spec.body("body").add_body(name="creeping", pos=self.position)
        give_mass(part, self.mass, np.zeros(3), 1e-9 * np.eye(3))
        circular = 2.0 * np.pi * 25.0  # the carriage's drive is stiff: 25 Hz
        part.add_joint(
            name="creeping",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=np.eye(3)[self.axis],
            stiffness=self.mass * circular**2,
            damping=self.mass * circular,
        )

    def drive(self, model: Any, data: Any, state: State) -> None:
        """See :class:`Effect`."""
        model.qpos_spring[model.joint("creeping").qposadr[0]] = self.speed * max(state.time, 0.0)
