"""A tracker's error that goes with the pose: markers that hide as the body turns, and lenses.

Cameras lose a marker behind the body at one turn and find it again at another. The pose that they make of the
markers left is off by what those were calibrated wrong, up to a centimetre or a degree, and comes back each
time that the body turns so. Such an error is no function of time, and no noise that averages out: it lies at
the swing's own frequency and its harmonics. It is taken as an unknown function of the largest turn, of
straight pieces between KNOTS, each knot with the std that the pose is seen to wander by. It is integrated
out of a run as an unseen sway is (unseen_sway.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Knots over the range of the turn. What hides a marker does so within a few per cent of a turn's range.
KNOTS = 17


@dataclass(frozen=True)
class Turning:
    """The largest turn of a run, as its tracker reads it."""

    key: tuple[str, str, tuple[int, ...]]  # of the channel that holds it
    middle: Array  # (w,) rad
    axis: Array  # (w,) unit vector
    knots: Array  # (k,) rad, ascending

    def angle(self, values: Array) -> Array:
        """(n,) rad, of a channel's samples (n, w)."""
        return np.asarray((values - self.middle) @ self.axis)

    def shapes(self, angle: Array) -> Array:
        """(n, k) one column for a knot: 1 there, 0 at its neighbours, straight between."""
        step = self.knots[1] - self.knots[0]
        return np.asarray(np.maximum(0.0, 1.0 - np.abs(angle[:, None] - self.knots) / step))


def turning_of(key: tuple[str, str, tuple[int, ...]], values: Array) -> Turning | None:
    """The turn along which rotation vectors (n, w) spread most; None where they are all one."""
    middle = np.mean(values, axis=0)
    axis = np.linalg.svd(values - middle, full_matrices=False)[2][0]
    along = (values - middle) @ axis
    low, high = float(np.min(along)), float(np.max(along))
    return Turning(key, middle, axis, np.linspace(low, high, KNOTS)) if high > low else None
