"""Outside the table: a person keeps the body swinging."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity, signed
from bench.concealed.effects.place import tank
from bench.concealed.scene import Array, Scene


@dataclass(frozen=True)
class PeriodicPush(Effect):
    """Half-sine pushes at a steady beat along one world axis, in every run from its first second on."""

    name = "periodic_push"
    outside = True
    near = ("external_force",)
    mechanical = True
    peak_force: float  # N
    period: float  # s
    share: float  # 1, of the period
    axis: int
    position: Array  # (3,) m, body

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> PeriodicPush:
        """From a finger to a hand."""
        peak = signed(rng, log_size(size, 0.0003, 0.006) * scene.body.mass * scene.rig.gravity)
        return cls(
            peak, rng.uniform(1.0, 3.0), rng.uniform(0.15, 0.4), int(rng.integers(2)), tank(rng, scene)
        )

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {"peak_force": quantity(self.peak_force, "N"), "period": quantity(self.period, "s")}
        where = {"axis": "xyz"[self.axis], "position": self.position.tolist()}
        return {"where": where, "parameters": parameters}

    def force(self, state: State) -> Array:
        """See :class:`Effect`."""
        turn = (state.time - 1.0) / self.period
        within = (turn % 1.0) / self.share
        if turn < 0.0 or within > 1.0:
            return np.zeros(6)
        return state.wrench_at(self.position, self.peak_force * np.sin(np.pi * within) * np.eye(3)[self.axis])
