"""What a device that measures a turn alone reads of the body's swinging beside, which nothing measures.

A camera that films the turning of a platform from above does not hang exactly over it, and does not look
straight down. As the body swings to the side by the angle s, the picture turns by the camera's lean times s,
and turns are seen larger or smaller by a share of s; a wide turn is seen otherwise to one side than to the
other. So beside the turn a(t), as measured, such a device reads
    (c1 + c3 a) cos(w t) + (c2 + c4 a) sin(w t) + c5 a^2,     w = sqrt(g / h),
lines at the swing's own frequency, at the sum and the difference of both, and at twice the turn's. A
gyroscope that is not mounted straight reads its rate. Amplitude and phase of that swing are a run's own, as
its start is. They are integrated out (marginal.py).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.alike_threads import alike_threads
from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.marginal import marginal
from rig_identification.estimate.unseen_swing import SWING
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: rad, by which a camera leans, or a gyroscope is turned against the vertical: six degrees.
LEANS = 0.1
#: Quantities that are a turn, or its rate.
TURNS = ("orientation", "angular_rate")


def one_turn(run: Run) -> bool:
    """Whether nothing but the turn about the vertical, or its rate, is measured."""
    return bool(run.channels) and all(c.quantity in TURNS and c.axes == (2,) for c in run.channels)


def sway_frequency(rig: Rig) -> float | None:
    """Hz, at which a body swings beside on alike threads; None on other rigs."""
    threads = alike_threads(rig)
    return None if threads is None else float(np.sqrt(rig.gravity / threads.height) / (2.0 * np.pi))


def sway_shapes(rig: Rig, run: Run, channel: Channel) -> Array | None:
    """(N, 5) what a channel may read at the nodes, each column for one std; None where nothing can swing."""
    frequency = sway_frequency(rig)
    if frequency is None or not one_turn(run):
        return None
    nodes = run.grid.step * np.arange(run.grid.nodes, dtype=np.float64)
    angle = 2.0 * np.pi * frequency * nodes
    swing = SWING * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turn = _turn_of(channel, nodes)[:, None]
    shapes = np.concatenate([LEANS * swing, turn * swing, LEANS * (turn**2 - np.mean(turn**2))], axis=1)
    if channel.quantity == "angular_rate":
        shapes = np.gradient(shapes, run.grid.step, axis=0)
    return np.asarray(shapes)


def _turn_of(channel: Channel, nodes: Array) -> Array:
    """(N,) rad, the turn about its mean that a channel measures, or of which it measures the rate."""
    read = np.interp(nodes, channel.time, channel.values[:, 0])
    read = read - np.mean(read)
    if channel.quantity == "angular_rate":
        steps = 0.5 * np.diff(nodes) * (read[1:] + read[:-1])
        read = np.concatenate([[0.0], np.cumsum(steps)])
        # What a bias adds up to is no turn
        read = read - np.polyval(np.polyfit(nodes, read, 1), nodes)
    return np.asarray(read)


def without_sway(seen: Array, columns: Array) -> float:
    """Whiten ``columns`` (m, c), in units of the samples' noise, by what may be seen of a sway, in place.

    seen (m, n): the shapes at the samples, in the same units. Returns what that adds to the sum of log
    standard deviations.
    """
    amounts, doubt = marginal(seen)
    columns[:] = amounts.without(columns)
    return doubt


def likeliest_sway(seen: Array, residual: Array) -> Array:
    """(n,) the likeliest amounts of the shapes, in units of their std. seen, residual: as in without_sway."""
    return np.asarray(np.linalg.solve(seen.T @ seen + np.eye(seen.shape[1]), seen.T @ residual))
