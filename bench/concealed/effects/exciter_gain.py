"""A scale error of the force cells under the exciter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class ExciterGain(Effect):
    """The ordinary gain error is replaced by this one."""

    name = "exciter_gain"
    gain: float  # 1

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> ExciterGain:
        """Beyond 3.5 of the default tolerances."""
        return cls(signed(rng, log_size(size, 0.0035, 0.06)))

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        return {"where": {"channel": "exciter"}, "parameters": {"gain": quantity(self.gain, "1")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        return replace(scene, errors=replace(scene.errors, force_gain=1.0 + self.gain))
