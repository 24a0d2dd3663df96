"""What an effect may change: what is true, the mechanism, the forces, or what a sensor reads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bench.concealed.measure import Readings, Samples
    from bench.concealed.scene import Plan, Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class State:
    """Motion of the body at one instant."""

    time: float  # s after the release; negative while the body is brought to rest
    position: Array  # (3,) m, body origin in world
    rotation: Array  # (3, 3) body to world
    velocity: Array  # (3,) m/s, body origin, world
    rate: Array  # (3,) rad/s, body

    def point(self, position: Array) -> tuple[Array, Array]:
        """World position (3,) and velocity (3,) of a point given in body coordinates."""
        arm = self.rotation @ position
        return self.position + arm, self.velocity + self.rotation @ np.cross(self.rate, position)

    def wrench_at(self, position: Array, force_world: Array) -> Array:
        """(6,) generalised force of a world force at a body point."""
        moment = np.cross(position, self.rotation.T @ force_world)
        return np.concatenate([force_world, moment])


class Effect:
    """One left-out piece of physics or sensor error. A subclass overrides what it changes."""

    name = ""  # a word of the contract's table, or of its own for one from outside
    outside = False  # not in the contract's table
    own_cables = False  # the effect replaces the rigid cables by its own
    mechanical = False  # the motion changes, not only what is read

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> Effect:
        """One of random place; ``size`` from 0 (faint) to 1 (strong)."""
        raise NotImplementedError

    def truth(self) -> dict[str, Any]:
        """``where``, ``parameters`` and whatever else a scorer needs, in the contract's words and units."""
        raise NotImplementedError

    def alter(self, scene: Scene) -> Scene:
        """The scene as it truly is; the description stays as it was."""
        return scene

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """Add to the mechanism: bodies, springs, and the cables themselves if they are :attr:`own_cables`."""

    def tension(self, model: Any, data: Any, scene: Scene) -> Array | None:
        """(cables,) N at the load cells if the mechanism's cables are this effect's own, else None."""
        return None

    def force(self, state: State) -> Array:
        """(6,) force on the body: force in world, moment about the body origin in body axes."""
        return np.zeros(6)

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """What the sensors sense, dense and free of noise."""
        return readings

    def corrupt(self, device: str, samples: Samples, scene: Scene, plan: Plan) -> Samples:
        """What one device sends, noise included."""
        return samples


def log_size(size: float, faint: float, strong: float) -> float:
    """A value between ``faint`` (size 0) and ``strong`` (size 1), evenly in its logarithm."""
    return float(faint * (strong / faint) ** size)


def quantity(value: float, unit: str) -> dict[str, Any]:
    """A parameter of truth.json."""
    return {"value": float(value), "unit": unit}
