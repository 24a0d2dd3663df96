"""A push from outside: a hand, a gust, a knock. Half a sine of force on one point of the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Push:
    """One push, or several alike."""

    peak_force: float  # N
    direction: Array  # (3,) body axes, of any length but zero
    position: Array  # (3,) m, body frame
    starts: Array  # (k,) s at which a push begins
    duration: float  # s, of each

    def wrench(self, time: Array) -> Array:
        """(n, 6) force N and moment N m about the body datum, body axes, at times (n,) s."""
        since = time[:, None] - self.starts
        inside = (since >= 0.0) & (since <= self.duration)
        size = self.peak_force * np.sum(np.sin(np.pi * since / self.duration) * inside, axis=1)
        along = self.direction / np.linalg.norm(self.direction)
        unit = np.concatenate([along, np.cross(self.position, along)])
        return np.asarray(size[:, None] * unit)
