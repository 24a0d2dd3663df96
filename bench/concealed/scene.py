"""What is true of one concealed session: frozen values, SI units, frames as in the recording contract.

Nothing here is shared with the package's own forward model but the value classes of a rig description.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """A rigid body, frame included."""

    mass: float  # kg
    center_of_mass: Array  # (3,) m, body
    inertia: Array  # (3, 3) kg m^2, about the centre of mass, body axes


@dataclass(frozen=True)
class Geometry:
    """Hinges and cables as they truly are."""

    ceiling: Array  # (n, 3) m, world
    hinge: Array  # (n, 3) m, body
    length: Array  # (n,) m, unloaded
    load_cell: tuple[str, ...]  # end that carries it: "ceiling" or "body"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the cables, ``cable_1`` first."""
        return tuple(f"cable_{i + 1}" for i in range(len(self.length)))


@dataclass(frozen=True)
class Devices:
    """True mounts; rotations turn device vectors into ``body``."""

    imu_position: Array  # (3,) m
    imu_rotation: Array  # (3, 3)
    inclinometer_rotation: Array  # (3, 3)
    exciter_position: Array  # (3,) m
    exciter_rotation: Array  # (3, 3)


@dataclass(frozen=True)
class SensorErrors:
    """Ordinary errors of the sensors: reading = gain * true + zero."""

    tension_gain: Array  # (n,) 1
    tension_zero: Array  # (n,) N
    force_gain: float  # 1, exciter
    acceleration_scale: Array  # (3,) 1, imu axes (0.01: reads 1 % high)
    acceleration_bias: Array  # (3,) m/s^2
    rate_scale: Array  # (3,) 1
    rate_bias: Array  # (3,) rad/s
    inclination_zero: Array  # (2,) rad
    clock: dict[
        str, float
    ]  # s by device ("imu", "inclinometer", "exciter", "tension"): positive, stamps late


@dataclass(frozen=True)
class Motor:
    """Speed of the unbalanced shaft: a smooth run-up, then a slow wobble about the set frequency."""

    frequency: float  # Hz
    unbalance: float  # kg m
    ramp: float  # s
    wobble: float  # 1
    wobble_period: float  # s

    def shaft(self, time: Array) -> tuple[Array, Array]:
        """(n,) angle in rad and (n,) rate in rad/s at ``time`` (n,), uniformly spaced from 0."""
        share = np.clip(time / self.ramp, 0.0, 1.0)
        run_up = share**2 * (3.0 - 2.0 * share)
        rate = (
            2.0
            * np.pi
            * self.frequency
            * run_up
            * (1.0 + self.wobble * np.sin(2.0 * np.pi * time / self.wobble_period))
        )
        step = np.diff(time)
        angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * step)])
        return angle, rate

    def force(self, angle: Array, rate: Array) -> Array:
        """(n, 3) force on the body in the exciter frame, turning in its xy plane."""
        size = self.unbalance * rate**2
        return np.stack([size * np.cos(angle), size * np.sin(angle), np.zeros_like(angle)], axis=1)


@dataclass(frozen=True)
class Plan:
    """One recording to be made."""

    name: str
    kind: str  # "static" or "dynamic"
    duration: float  # s
    holdout: bool = False
    start: str = "rest"  # "rest", "thesis" (described pose, released), "pull", "pull2" (held aside, released)
    pull: Array = field(default_factory=lambda: np.zeros(3))  # (3,) N, world, before release
    pull_point: Array = field(default_factory=lambda: np.zeros(3))  # (3,) m, body
    motor: Motor | None = None
    dummy_mass: float = 0.0  # kg
    dummy_position: Array = field(default_factory=lambda: np.zeros(3))  # (3,) m, body
    first_sample: float = 0.0  # s after the release at which the recording begins


@dataclass(frozen=True)
class Scene:
    """Everything that is true of a session, and what its lab believes (``rig``)."""

    seed: int
    geometry_name: str
    rig: Rig
    body: Body
    geometry: Geometry
    devices: Devices
    errors: SensorErrors
    level: Array  # (3,) rotation vector, rad: turns described ceiling points into true ones
    plans: tuple[Plan, ...]
    engine: str = "mujoco"  # or "exudyn": what moves it
    at_rest: tuple[Array, Array] | None = None  # position (3,) and rotation (3, 3) of the body, hanging
