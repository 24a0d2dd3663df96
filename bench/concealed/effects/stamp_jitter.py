"""Outside the table: stamps of the inertial unit jitter, samples drop out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.scene import Plan, Scene
from bench.concealed.signals import Samples


@dataclass(frozen=True)
class StampJitter(Effect):
    """Each stamp is off by its own share of the interval; some samples are missing."""

    name = "stamp_jitter"
    outside = True
    near = ("clock_offset",)
    jitter: float  # s, half width of an even spread
    lost: float  # 1
    seed: int

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> StampJitter:
        """Up to just short of samples changing places (interval 5 ms)."""
        return cls(log_size(size, 0.0008, 0.0024), rng.uniform(0.0, 0.1), int(rng.integers(2**31)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {"jitter": quantity(self.jitter, "s"), "lost": quantity(self.lost, "1")}
        return {"where": {"channel": "imu"}, "parameters": parameters}

    def corrupt(self, device: str, samples: Samples, scene: Scene, plan: Plan) -> Samples:
        """See :class:`Effect`."""
        if device != "imu":
            return samples
        rng = np.random.default_rng([self.seed, len(samples.time)])
        kept = rng.random(len(samples.time)) >= self.lost
        time = samples.time + rng.uniform(-self.jitter, self.jitter, len(samples.time))
        return Samples(time[kept], samples.values[kept])
