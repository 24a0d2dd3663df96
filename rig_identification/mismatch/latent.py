"""The missing wrench itself: what force and moment over time the model would need to be right.

A random wrench is added to the model (white between nodes, wide enough to carry whatever is missing), and
the fixed-interval smoother gives its best course given every sample of the piece. The inertia
is not fitted to it, so that it cannot be bent to swallow it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
#: Share of the largest eigenvalue below which a force turns too little to tell where along it it acts.
NARROW, TINY = 1e-3, 1e-30


def strongest_push(missing: MissingWrench, middle: Array) -> Push:
    """Where the missing force peaks, and how long it lasts about there."""
    force = np.einsum("nij,nj->ni", missing.R_world_body, missing.wrench[:, :3])
    force = force - np.median(force, axis=0)
    size = np.linalg.norm(force, axis=1)
    k = int(np.argmax(size))
    a = b = k
    while a > 0 and size[a - 1] > EDGE * size[k]:
        a -= 1
    while b < size.size - 1 and size[b + 1] > EDGE * size[k]:
        b += 1
    quiet = np.concatenate([size[:a], size[b + 1 :]])
    here = missing.wrench[a : b + 1] - np.median(missing.wrench, axis=0)
    # Least squares over the push: moment about the datum = point x force
    rows = np.concatenate([-_cross(f) for f in here[:, :3]])
    right = np.concatenate([m - np.cross(middle, f) for f, m in zip(here[:, :3], here[:, 3:], strict=True)])
    offset = np.linalg.lstsq(rows, right, rcond=0.05)[0]
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
    # |offset x F|^2 and the products with M, summed over the course
    normal = np.sum(force**2) * np.eye(3) - force.T @ force
    right = np.sum(np.cross(force, about), axis=0)
    values, vectors = np.linalg.eigh(normal)
    told = values > NARROW * values[-1]
    offset = vectors[:, told] @ ((vectors[:, told].T @ right) / values[told])
    left = about - np.cross(offset, force)
    return LineOfAction(middle + offset, 1.0 - float(np.sum(left**2) / max(np.sum(about**2), TINY)))


def _cross(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
