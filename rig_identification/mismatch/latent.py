"""The missing wrench itself: what force and moment over time the model would need to be right.

A random wrench is added to the model (white between nodes, wide enough to carry whatever is missing), and
the fixed-interval smoother gives its best course given every sample of the piece. The inertia
is not fitted to it, so that it cannot be bent to swallow it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.model.so3 import skew

Array = NDArray[np.float64]

#: Standard deviation of the random wrench's mean over a tenth of a second, as a share of the weight.
SHARE = 0.02
#: Interval (s) over which it is averaged: shorter courses are noise.
AVERAGED = 0.1


@dataclass(frozen=True)
class MissingWrench:
    """Force and moment that the model lacks in a run."""

    recording: str
    time: Array  # (N,) s after the recording's start
    wrench: Array  # (N, 6) N and N m about the datum, body axes, averaged over AVERAGED
    R_world_body: Array  # (N, 3, 3)
    states: Array  # (N, 12) motion as smoothed


@dataclass(frozen=True)
class Push:
    """The strongest course of a missing wrench."""

    start: float  # s after the recording's start
    end: float  # s
    peak: Array  # (3,) N, world
    std: float  # N: how much the missing force varies where nothing pushes
    point: Array  # (3,) m, body: on the line of the force, nearest the middle of the body

    @property
    def size(self) -> float:
        """N."""
        return float(np.linalg.norm(self.peak))


#: Share of the peak at which a push begins and ends.
EDGE = 0.15
#: Share of the largest singular value below which a force turns too little to tell where along it it acts.
NARROW, TINY = 1e-3**0.5, 1e-30


def strongest_push(
    missing: MissingWrench, middle: Array, start: float = -np.inf, end: float = np.inf
) -> Push:
    """Where the missing force peaks from ``start`` to ``end`` (s), and how long it lasts about there."""
    force = np.einsum("nij,nj->ni", missing.R_world_body, missing.wrench[:, :3])
    force = force - np.median(force, axis=0)
    size = np.linalg.norm(force, axis=1)
    k = int(np.argmax(np.where((missing.time >= start) & (missing.time <= end), size, -1.0)))
    a = b = k
    while a > 0 and size[a - 1] > EDGE * size[k]:
        a -= 1
    while b < size.size - 1 and size[b + 1] > EDGE * size[k]:
        b += 1
    quiet = np.concatenate([size[:a], size[b + 1 :]])
    here = missing.wrench[a : b + 1] - np.median(missing.wrench, axis=0)
    offset = _arm(here[:, :3], here[:, 3:] - np.cross(middle, here[:, :3]), 0.05)
    spread = float(np.sqrt(np.mean(quiet**2))) if quiet.size else float("nan")
    return Push(float(missing.time[a]), float(missing.time[b]), force[k], spread, middle + offset)


@dataclass(frozen=True)
class LineOfAction:
    """Where a missing wrench acts as one force."""

    point: Array  # (3,) m, body: nearest the middle of the body
    share: float  # of the moment about that middle, as a mean square, that a force there has


def line_of_action(missing: MissingWrench, middle: Array) -> LineOfAction:
    """The one point of the body at which the missing force has most of the missing moment over its course.

    Least squares of M - middle x F = offset x F, both less their means. Along a force that never turns the
    point is left where it is nearest to the middle.
    """
    wrench = missing.wrench - np.mean(missing.wrench, axis=0)
    force, about = wrench[:, :3], wrench[:, 3:] - np.cross(middle, wrench[:, :3])
    offset = _arm(force, about, NARROW)
    left = about - np.cross(offset, force)
    return LineOfAction(middle + offset, 1.0 - float(np.sum(left**2) / max(np.sum(about**2), TINY)))


def _arm(force: Array, moment: Array, narrow: float) -> Array:
    """(3,) arm with which ``force`` (n, 3) makes ``moment`` (n, 3) in least squares: arm x force.

    narrow: share of the largest singular value below which the force turns too little to tell the arm.
    """
    return np.asarray(np.linalg.lstsq(-skew(force).reshape(-1, 3), moment.reshape(-1), rcond=narrow)[0])
