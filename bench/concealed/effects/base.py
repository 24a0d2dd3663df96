"""What an effect may change: what is true, the mechanism, the forces, or what a sensor reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.concealed.scene import Array, Body, Plan, Scene
from bench.concealed.signals import Readings, Samples, Trajectory


@dataclass(frozen=True)
class State:
    """Motion of the body at one instant."""

    recording: str
    time: float  # s after the release; negative while the body is brought to rest
    position: Array  # (3,) m, body origin in world
    rotation: Array  # (3, 3) body to world
    velocity: Array  # (3,) m/s, body origin, world
    rate: Array  # (3,) rad/s, body

    def point(self, position: Array) -> tuple[Array, Array]:
        """World position (3,) and velocity (3,) of a point given in body coordinates."""
        return (
            self.position + self.rotation @ position,
            self.velocity + self.rotation @ np.cross(self.rate, position),
        )

    def wrench_at(self, position: Array, force_world: Array) -> Array:
        """(6,) generalised force of a world force at a body point."""
        return np.concatenate([force_world, np.cross(position, self.rotation.T @ force_world)])


class Effect:
    """One left-out piece of physics or sensor error. A subclass overrides what it changes."""

    name = ""  # a word of the contract's table, or of its own for one from outside
    outside = False  # not in the contract's table
    near: tuple[str, ...] = ()  # from outside: words of the table that a fair judge might let pass
    mechanical = False  # the motion changes, not only what is read
    aside = False  # the body must be released from rest under a pull: from the level pose it would bounce
    own_cables = False  # the effect replaces the rigid cables by its own
    stretches = False  # its cables do not keep their length
    lets_go = False  # its cables do not push
    lab_form: type[Effect] | None = None  # the form that labs have it in, if another
    form = False  # another form of the effect of the same name, which draws it: not listed by itself

    @classmethod
    def draw(cls, rng: np.random.Generator, scene: Scene, size: float) -> Effect:
        """One of random place; ``size`` from 0 (faint) to 1 (strong)."""
        raise NotImplementedError

    @classmethod
    def draw_lab(cls, rng: np.random.Generator, scene: Scene, size: float) -> Effect:
        """One of the sizes and forms that labs have; where nothing else is said those of :meth:`draw`."""
        return (cls.lab_form or cls).draw(rng, scene, size)

    def truth(self) -> dict[str, Any]:
        """``where`` and ``parameters``, in the contract's words and units."""
        raise NotImplementedError

    def alter(self, scene: Scene) -> Scene:
        """The scene as it truly is; the description stays as it was."""
        return scene

    def rigid_part(self, body: Body) -> Body:
        """What is left of the whole body once the parts that this effect sets free are taken out."""
        return body

    def ceiling(self, spec: Any, scene: Scene) -> Any:
        """The MuJoCo body that carries the ceiling points, None for the room itself."""
        return None

    def build(self, spec: Any, scene: Scene, plan: Plan) -> None:
        """Add to the mechanism: bodies, springs, and the cables themselves if they are :attr:`own_cables`."""

    def assemble(self, made: Any, scene: Scene) -> None:
        """Add to the second engine's mechanism, an :class:`~bench.concealed.assembly.Assembly`."""

    def fastest(self, scene: Scene) -> float:
        """rad/s of the fastest swing that the effect brings, 0 if none: an engine's step follows it."""
        return 0.0

    @classmethod
    def in_second(cls) -> bool:
        """Whether the second engine has this effect as labs have it."""
        own = cls.lab_form or cls
        first = (own.build, own.ceiling, own.drive) != (Effect.build, Effect.ceiling, Effect.drive)
        return own.assemble is not Effect.assemble or not first

    def tension(self, model: Any, data: Any, scene: Scene) -> Array | None:
        """(cables,) N at the load cells if the mechanism's cables are this effect's own, else None."""
        return None

    def force(self, state: State) -> Array:
        """(6,) force on the body: force in world, moment about the body origin in body axes."""
        raise NotImplementedError

    def bind(self, scene: Scene) -> Callable[[State], Array] | None:
        """The force law for this scene, None if the effect puts no force of its own on the body."""
        return None if type(self).force is Effect.force else self.force

    def drive(self, model: Any, data: Any, state: State) -> None:
        """Change the mechanism while it runs."""

    @property
    def drives(self) -> bool:
        """Whether :meth:`drive` does anything."""
        return type(self).drive is not Effect.drive

    def distort(self, readings: Readings, scene: Scene, plan: Plan) -> Readings:
        """What the sensors feel, every millisecond and free of noise."""
        return readings

    def corrupt(self, device: str, samples: Samples, scene: Scene, plan: Plan) -> Samples:
        """What one device sends, noise included."""
        return samples

    def observe(self, scene: Scene, paths: Sequence[Trajectory]) -> dict[str, Any] | None:
        """What of ``where`` only the motion tells; None if the effect did not show at all."""
        return {}

    def stronger(self) -> Effect:
        """What to try if :meth:`observe` saw nothing."""
        return self


def log_size(size: float, faint: float, strong: float) -> float:
    """A value between ``faint`` (size 0) and ``strong`` (size 1), evenly in its logarithm."""
    return float(faint * (strong / faint) ** size)


def signed(rng: np.random.Generator, value: float) -> float:
    """The value or its opposite."""
    return float(rng.choice([-1.0, 1.0]) * value)


def quantity(value: float, unit: str) -> dict[str, Any]:
    """A parameter of truth.json."""
    return {"value": float(value), "unit": unit}
