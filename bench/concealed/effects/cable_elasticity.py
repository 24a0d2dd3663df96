"""The cables stretch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.effects.base import Effect, log_size, quantity
from bench.concealed.scene import Array, Plan, Scene


@dataclass(frozen=True)
class CableElasticity(Effect):
    """Every cable a spring EA / length that only pulls, with a damper beside it.

    The damper is 2 zeta sqrt(k m / n): zeta of critical for the cable's share of the body.
    """

    name = "cable_elasticity"
    mechanical = True
    aside = True
    own_cables = True
    stretches = True
    axial_stiffness: float  # N
    damping_ratio: float  # 1

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableElasticity:
        """From wire rope of a crane down to webbing."""
        return cls(log_size(size, 1e8, 1e6), float(np.exp(rng.uniform(np.log(0.003), np.log(0.05)))))

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> CableElasticity:
        """See :meth:`of_lab`."""
        return cls.of_lab(rng, size)

    @classmethod
    def of_lab(cls, rng: np.random.Generator, size: float) -> CableElasticity:
        """Down to 0.5 MN."""
        return cls(log_size(size, 5e7, 5e5), log_size(float(rng.uniform()), 0.003, 0.05))

    def stiffened(self, times: float) -> CableElasticity:
        """The same cables ``times`` as stiff."""
        return CableElasticity(times * self.axial_stiffness, self.damping_ratio)

    def truth(self) -> dict[str, Any]:
        """See :class:`Effect`."""
        parameters = {
            "axial_stiffness": quantity(self.axial_stiffness, "N"),
            "damping_ratio": quantity(self.damping_ratio, "1"),
        }
        return {"parameters": parameters}

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """See :class:`Effect`."""
        stiffness, damping = self._constants(scene)
        for i, length in enumerate(scene.geometry.length):
            tendon = spec.add_tendon(
                name=f"cable_{i}",
                stiffness=stiffness[i],
                damping=damping[i],
                springlength=[0.0, length],
            )
            tendon.wrap_site(f"ceiling_{i}")
            tendon.wrap_site(f"hinge_{i}")

    def assemble(self, made: Any, scene: Scene) -> None:
        """See :class:`Effect`."""
        g = scene.geometry
        for cable in zip(g.ceiling, g.hinge, g.length, *self._constants(scene), strict=True):
            made.elastic_cable(*cable)

    def fastest(self, scene: Scene) -> float:
        """Of the bounce; that of rocking may be twice as fast."""
        return 2.0 * float(np.sqrt(np.sum(self._constants(scene)[0]) / scene.body.mass))

    def tension(self, model: Any, data: Any, scene: Scene) -> Array:
        """See :class:`Effect`."""
        stiffness, damping = self._constants(scene)
        # By name: another effect's tendon may come before the cables
        cables = [data.tendon(f"cable_{i}") for i in range(len(stiffness))]
        length, rate = np.array([[c.length[0], c.velocity[0]] for c in cables]).T
        stretch = np.maximum(length - scene.geometry.length, 0.0)
        return np.asarray(stiffness * stretch + damping * rate)

    def _constants(self, scene: Scene) -> tuple[Array, Array]:
        stiffness = self.axial_stiffness / scene.geometry.length
        share = scene.body.mass / len(stiffness)
        return stiffness, 2.0 * self.damping_ratio * np.sqrt(stiffness * share)
