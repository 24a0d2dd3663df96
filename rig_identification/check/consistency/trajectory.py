"""Pose over time and what follows from it: rate, its change, and proper acceleration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.rig import Mount

Array = NDArray[np.float64]


def cross(a: Array, b: Array) -> Array:
    """(..., 3) a x b; numpy's own spends ten times as long on finding out the axes of small arrays."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    out[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    out[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    out[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return out


def rotation(mount: Mount) -> Array:
    """(3, 3) from a device's axes to the body's."""
    return np.asarray(Rotation.from_quat(mount.orientation).as_matrix())


@dataclass(frozen=True)
class Trajectory:
    """Pose and its derivatives at the instants of a run."""

    position: Array  # (N, 3) m, world
    velocity: Array  # (N, 3)
    acceleration: Array  # (N, 3)
    turn: Array  # (N, 3) rotation vector from the rest attitude, body axes
    turn_rate: Array  # (N, 3)
    turn_change: Array  # (N, 3)
    R0: Array  # (3, 3) rest attitude

    @property
    def R(self) -> Array:
        """(N, 3, 3) body to world."""
        return np.asarray(self.R0 @ Rotation.from_rotvec(self.turn).as_matrix())

    @property
    def rate(self) -> Array:
        """(N, 3) rad/s, body axes, to third order of the turn."""
        q, v = self.turn, self.turn_rate
        once = cross(q, v)
        return np.asarray(v - 0.5 * once + cross(q, once) / 6.0)

    @property
    def rate_change(self) -> Array:
        """(N, 3) rad/s^2."""
        q, v, a = self.turn, self.turn_rate, self.turn_change
        once = cross(q, a)
        twice = cross(v, cross(q, v)) + cross(q, once)
        return np.asarray(a - 0.5 * once + twice / 6.0)

    def proper_acceleration(self, gravity: float) -> Array:
        """(N, 3) m/s^2: specific force at the body's datum, body axes."""
        total = self.acceleration + np.array([0.0, 0.0, gravity])
        return np.asarray(np.einsum("nji,nj->ni", self.R, total))
