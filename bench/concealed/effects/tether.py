"""A hose or wire pulls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.effects.hose import Hose
from bench.concealed.effects.place import hanging, tank
from bench.concealed.scene import Array, Plan, Scene


@dataclass(frozen=True)
class Tether(Effect):
    """A spring between a wall and a point of the body, in tension all the time."""

    name = "tether"
    mechanical = True
    lab_form = Hose
    stiffness: float  # N/m
    position: Array  # (3,) m, body
    axis: int  # it runs along this world axis while the body hangs at rest
    side: float  # -1 or 1
    preload: float  # m it is stretched by while the body hangs at rest
    reach: float  # m from the wall to the body
    wall: Array  # (3,) m, world

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> Tether:
        """From a sensor lead to a stiff hose."""
        place, axis = tank(rng, scene), int(rng.integers(2))
        reach = rng.uniform(0.8, 2.0)
        side = float(rng.choice([-1.0, 1.0]))
        wall = hanging(scene, place) + side * reach * np.eye(3)[axis]
        return cls(log_size(size, 5.0, 1500.0), place, axis, side, rng.uniform(0.08, 0.2), reach, wall)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "stiffness": quantity(self.stiffness, "N/m"),
            "preload": quantity(self.stiffness * self.preload, "N"),
        }
        where = {"position": self.position.tolist(), "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": parameters}

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        spec.worldbody.add_site(name="wall", pos=self.wall)
        spec.body("body").add_site(name="tethered", pos=self.position)
        tendon = spec.add_tendon(
            name="tether", stiffness=self.stiffness, springlength=[0.0, self.reach - self.preload]
        )
        tendon.wrap_site("wall")
        tendon.wrap_site("tethered")
