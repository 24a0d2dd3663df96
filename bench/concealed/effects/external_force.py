"""A push, a gust, a person's hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, State, log_size, quantity, signed
from bench.concealed.effects.place import tank
from bench.concealed.scene import Array, Scene


@dataclass(frozen=True)
class ExternalForce(Effect):
    """One half-sine push along a world axis in one run."""

    name = "external_force"
    mechanical = True
    peak_force: float  # N
    axis: int
    position: Array  # (3,) m, body
    recording: str
    start: float  # s after the recording's first stamp
    end: float  # s
    late: float  # s, release to first stamp

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ExternalForce:
        """From a touch to a shove."""
        plan = next(p for p in scene.plans if p.name == "run_1")
        start = rng.uniform(0.2, 0.75) * plan.duration
        peak = signed(rng, log_size(size, 0.0005, 0.03) * scene.body.mass * scene.rig.gravity)
        end = start + rng.uniform(0.3, 2.0)
        return cls(peak, int(rng.integers(2)), tank(rng, scene), plan.name, start, end, plan.first_sample)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        times = [{"recording": self.recording, "start": self.start, "end": self.end}]
        where = {"axis": "xyz"[self.axis], "position": self.position.tolist(), "times": times}
        return {"where": where, "parameters": {"peak_force": quantity(self.peak_force, "N")}}

    def force(self, state: State) -> Array:
        """See :class:`Effect`."""
        share = (state.time - self.late - self.start) / (self.end - self.start)
        if state.recording != self.recording or not 0.0 < share < 1.0:
            return np.zeros(6)
        force = self.peak_force * np.sin(np.pi * share) * np.eye(3)[self.axis]
        return state.wrench_at(self.position, force)
