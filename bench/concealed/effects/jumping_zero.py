"""Outside the table: the zero of a load cell jumps while a run is recorded, and stays where it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import random_cable
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Readings


@dataclass(frozen=True)
class JumpingZero(Effect):
    """From an instant of the first run on, and in every later recording, a cell reads so much more."""

    name = "jumping_zero"
    outside = True
    near = ("load_cell_offset",)
    cable: int
    jump: float  # N
    instant: float  # s after the release of the first run

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> JumpingZero:
        """From a few newtons."""
        return cls(
            random_cable(rng, scene), signed(rng, log_size(size, 3.0, 200.0)), float(rng.uniform(3.0, 9.0))
        )

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": f"cable_{self.cable + 1}", "from": {"recording": "run_1", "start": self.instant}}
        return {"where": where, "parameters": {"offset": quantity(self.jump, "N")}}

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """See :class:`Effect`."""
        tension = readings.tension.copy()
        tension[later(readings, plan, self.instant), self.cable] += self.jump
        return replace(readings, tension=tension)


def later(readings: Readings, plan: Plan, instant: float) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(N,) which readings come after an instant (s after the release) of the first run."""
    if plan.kind != "dynamic":
        return np.zeros(readings.time.size, dtype=bool)
    return np.asarray(readings.time >= (instant if plan.name == "run_1" else -np.inf))
