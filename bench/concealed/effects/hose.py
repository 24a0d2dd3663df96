"""A hose or wire between a point of the body and a point of the room, in any direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect, State, log_size, quantity
from bench.concealed.effects.place import hanging, tank
from bench.concealed.scene import Array, Scene
from bench.concealed.signals import Trajectory


@dataclass(frozen=True)
class Hose(Effect):
    """It pulls with k s + c ds/dt and never pushes; s is how far its ends are beyond its free length.

    At s <= 0 it hangs loose.
    """

    name = "tether"
    form = True
    mechanical = True
    stiffness: float  # N/m
    damping: float  # N s/m, along itself
    preload: float  # N, while the body hangs as it would without it
    position: Array  # (3,) m, body
    anchor: Array  # (3,) m, world
    home: Array  # (3,) m, world: the body's point while the body hangs without it

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> Hose:
        """From a cable of sensors to a fuel hose."""
        place = tank(rng, scene)
        home = hanging(scene, place)
        towards = rng.normal(size=3)
        towards /= np.linalg.norm(towards)
        anchor = np.round(home + rng.uniform(0.8, 3.0) * towards, 4)
        damping = log_size(float(rng.uniform()), 0.5, 30.0)
        preload = log_size(float(rng.uniform()), 5.0, 60.0)
        return cls(log_size(size, 30.0, 500.0), damping, preload, place, anchor, home)

    @property
    def length(self) -> float:
        """Free length, m."""
        return float(np.linalg.norm(self.anchor - self.home)) - self.preload / self.stiffness

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "stiffness": quantity(self.stiffness, "N/m"),
            "damping": quantity(self.damping, "N*s/m"),
            "preload": quantity(self.preload, "N"),
            "length": quantity(self.length, "m"),
        }
        along = self.anchor - self.home
        where = {
            "position": self.position.tolist(),
            "anchor": self.anchor.tolist(),
            "direction": (along / np.linalg.norm(along)).tolist(),
        }
        return {"where": where, "parameters": parameters}

    def pull(self, stretch: float, rate: float) -> float:
        """N, from how far it is stretched in m and how fast in m/s."""
        return max(self.stiffness * stretch + self.damping * rate, 0.0) if stretch > 0.0 else 0.0

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        made.pulled(self.anchor, self.position, self.length, self.pull)

    def force(self, state: State) -> Array:
        """See :class:`Effect`."""
        place, velocity = state.point(self.position)
        away = self.anchor - place
        reach = float(np.sqrt(away @ away))
        along = away / reach
        pull = self.pull(reach - self.length, -float(along @ velocity))
        return state.wrench_at(self.position, pull * along)

    def observe(self, scene: Scene, paths: Sequence[Trajectory]) -> dict[str, Any]:
        """Share of each recording in which it hangs loose."""
        shares = {}
        for plan, path in zip(scene.plans, paths, strict=True):
            place = path.position + Rotation.from_quat(path.quaternion).apply(self.position)
            reach = np.linalg.norm(self.anchor - place, axis=1)
            shares[plan.name] = float(np.mean(reach <= self.length))
        return {"slack_share": shares}
