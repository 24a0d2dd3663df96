"""One hinge sits elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect, log_size, quantity, signed
from bench.concealed.effects.place import random_cable
from bench.concealed.scene import Scene


@dataclass(frozen=True)
class HingePosition(Effect):
    """True position of one hinge: the described one and ``error`` along one axis (world or body)."""

    name = "hinge_position"
    mechanical = True
    cable: int
    end: str  # "ceiling" or "body"
    axis: int
    error: float  # m

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> HingePosition:
        """Beyond 3.5 of the default tolerances."""
        end = str(rng.choice(["ceiling", "body"]))
        error = signed(rng, log_size(size, 0.0025, 0.04))
        return cls(random_cable(rng, scene), end, int(rng.integers(3)), error)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        where = {"channel": f"cable_{self.cable + 1}", "end": self.end, "axis": "xyz"[self.axis]}
        return {"where": where, "parameters": {"error": quantity(self.error, "m")}}

    def alter(self, scene: Scene) -> Scene:
        """See :class:`Effect`."""
        cable = scene.rig.cables[self.cable]
        if self.end == "body":
            hinge = scene.geometry.hinge.copy()
            hinge[self.cable, self.axis] = cable.body_point[self.axis] + self.error
            return replace(scene, geometry=replace(scene.geometry, hinge=hinge))
        # The description lives in the ceiling's own level, the truth in the vertical's.
        level = Rotation.from_rotvec(scene.level)
        flat = level.inv().apply(scene.geometry.ceiling)
        flat[self.cable, self.axis] = cable.ceiling_point[self.axis] + self.error
        return replace(scene, geometry=replace(scene.geometry, ceiling=level.apply(flat)))
