"""Forces that shake the body: a mass on a motor's shaft, or any function of time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError

Array = NDArray[np.float64]

PLANES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


class ForceProgram(Protocol):
    """Force on the body at the exciter's mount over time."""

    @property
    def axes(self) -> str:
        """Axes of the components: "exciter", "body" or "world"."""
        ...

    def __call__(self, time: Array) -> Array:
        """(n, 3) N at the times (n,) s."""
        ...


@dataclass(frozen=True)
class UnbalancedMass:
    """A point mass on an arm that a motor turns in a plane of the exciter frame.

    Turning at w it pulls outward with m r w^2, and pushes back with m r dw/dt while the motor
    speeds up (the reaction to the mass' acceleration about a shaft that stands still). The
    speed rises over ``ramp`` seconds as 3 u^2 - 2 u^3, so that the force has no jump.
    """

    unbalance: float  # kg m, mass times arm
    frequency: float  # Hz, at full speed
    plane: str = "xy"  # the arm points along its first axis at angle 0, its second at 90 degrees
    ramp: float = 0.0  # s from standstill to full speed
    angle: float = 0.0  # rad, of the arm at time 0
    axes: str = "exciter"

    def __post_init__(self) -> None:
        if self.plane not in PLANES:
            raise InputError(f"exciter: plane {self.plane!r} is unknown; give xy, xz or yz")

    def shaft(self, time: Array) -> Array:
        """(n, 2) angle rad and rate rad/s."""
        full = 2.0 * np.pi * self.frequency
        if self.ramp <= 0.0:
            return np.stack([self.angle + full * time, np.full(time.shape, full)], axis=1)
        u = np.clip(time / self.ramp, 0.0, 1.0)
        turned = self.ramp * (u**3 - 0.5 * u**4) + np.maximum(time - self.ramp, 0.0)
        return np.stack([self.angle + full * turned, full * (3.0 * u**2 - 2.0 * u**3)], axis=1)

    def __call__(self, time: Array) -> Array:
        """(n, 3) N at the times (n,) s, exciter frame."""
        angle, rate = self.shaft(time).T
        change = np.zeros_like(time)
        if self.ramp > 0.0:
            u = np.clip(time / self.ramp, 0.0, 1.0)
            change = 2.0 * np.pi * self.frequency * 6.0 * u * (1.0 - u) / self.ramp
        first, second = PLANES[self.plane]
        force = np.zeros((time.size, 3))
        outward, across = self.unbalance * rate**2, -self.unbalance * change
        force[:, first] = outward * np.cos(angle) - across * np.sin(angle)
        force[:, second] = outward * np.sin(angle) + across * np.cos(angle)
        return force


@dataclass(frozen=True)
class Multisine:
    """A sum of sines along each axis of the exciter frame, for an exciter that gives any force.

    Phases are Schroeder's (IEEE Trans. Inf. Theory 16, 1970), which keep the sum's peak low, and differ from
    axis to axis. The force rises over ``ramp`` seconds as 3 u^2 - 2 u^3, so that it has no jump.
    """

    largest: float  # N, that no axis' force exceeds
    frequencies: tuple[float, ...]  # Hz
    ramp: float = 0.0  # s
    axes: str = "exciter"

    def __call__(self, time: Array) -> Array:
        """(n, 3) N at the times (n,) s, exciter frame."""
        count = len(self.frequencies)
        order = np.arange(count)
        force = np.zeros((time.size, 3))
        for axis in range(3):
            phase = -np.pi * order * (order + 1) / count + 2.0 * np.pi * axis / 3.0
            angles = 2.0 * np.pi * np.outer(time, self.frequencies) + phase
            force[:, axis] = np.sum(np.sin(angles), axis=1) * self.largest / count
        if self.ramp <= 0.0:
            return force
        u = np.clip(time / self.ramp, 0.0, 1.0)
        return np.asarray((3.0 * u**2 - 2.0 * u**3)[:, None] * force)
