"""The missing wrench itself: what force and moment over time the model would need to be right.

A random wrench is added to the model (white between nodes, wide enough to carry whatever is missing), and
the fixed-interval smoother gives its best course given every sample of the piece. The inertia
is not fitted to it, so that it cannot be bent to swallow it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.prediction import Bench, linearise_run
from rig_identification.estimate.start_state import fit_start
from rig_identification.estimate.track import smoothed_from, wrench_noise
from rig_identification.model.motion import State

Array = NDArray[np.float64]

#: Standard deviation of the random wrench's mean over a tenth of a second, as a share of the weight.
SHARE = 0.02
#: Interval (s) over which it is averaged: shorter courses are noise.
AVERAGED = 0.1
#: Std (m and rad; m/s and rad/s) of a start state that was fitted.
LAUNCHED = (0.002, 0.01)


@dataclass(frozen=True)
class MissingWrench:
    """Force and moment that the model lacks in a run."""

    recording: str
    time: Array  # (N,) s after the recording's start
    wrench: Array  # (N, 6) N and N m about the datum, body axes, averaged over AVERAGED
    R_world_body: Array  # (N, 3, 3)
    states: Array  # (N, 12) motion as smoothed


def missing_wrench(bench: Bench, run: Run, theta: Array, rest: State, mass: float) -> MissingWrench | None:
    """Smooth the missing wrench of one run at parameters ``theta``; None where it cannot be followed."""
    size = float(np.max(extent(bench.rig)))
    step = run.grid.step
    noise = wrench_noise(mass, bench.rig.gravity, 0.3 * size, step, SHARE)
    start = launch_state(bench, run, theta, rest, noise)
    found = fit_start(bench, run, theta, start, tolerance=0.1, extra_noise=noise)
    if found is None:
        return None
    linearised = linearise_run(bench, run, theta, found[1], start_only=True, extra_noise=noise)
    if linearised is None:
        return None
    corrections, wrenches = smoothed_from(linearised, *LAUNCHED)
    width = max(1, round(AVERAGED / step))
    kernel = np.ones(width) / width
    averaged: Array = np.stack([np.convolve(w, kernel, mode="same") for w in wrenches.T], axis=1)
    return MissingWrench(
        run.recording.name,
        np.asarray(run.offset + step * np.arange(run.grid.nodes), dtype=np.float64),
        averaged,
        linearised.motion.R_world_body,
        linearised.motion.states[:, :12] + corrections[:, :12],
    )


def joined(parts: list[MissingWrench]) -> MissingWrench:
    """Pieces of one recording, one after the other."""
    parts = sorted(parts, key=lambda p: p.time[0])
    return replace(
        parts[0],
        time=np.concatenate([p.time for p in parts]),
        wrench=np.concatenate([p.wrench for p in parts]),
        R_world_body=np.concatenate([p.R_world_body for p in parts]),
        states=np.concatenate([p.states for p in parts]),
    )


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


def _cross(v: Array) -> Array:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
