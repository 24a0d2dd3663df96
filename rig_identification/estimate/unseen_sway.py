"""What a device that measures a turn alone reads of the body's swinging beside, which nothing measures.

A camera that films the turning of a platform from above does not hang exactly over it, and does not look
straight down. As the body swings to the side by the angle s, the picture turns by the camera's lean times s,
and turns are seen larger or smaller by a share of s; a wide turn is seen otherwise to one side than to the
other. So beside the turn a(t), as measured, such a device reads
    (c1 + c3 a) cos(w t) + (c2 + c4 a) sin(w t) + c5 a^2,     w = sqrt(g / h),
lines at the swing's own frequency, at the sum and the difference of both, and at twice the turn's. A
gyroscope that is not mounted straight reads its rate.

A camera reads its picture row by row. A marker that turns or swings up the picture is seen earlier than one
further down, by up to the time r between two pictures over the picture's height. So the turn is read at
another time as the body turns and swings, and beside the turn stands its rate a' times both:
    (c6 cos(w t) + c7 sin(w t) + c8 a) a'
at the same frequencies, a quarter of a swing apart from what a lean makes.

Amplitude and phase of that swing are a run's own, as its start is. They are integrated out (marginal.py).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rig_identification.estimate.alike_threads import alike_threads
from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.marginal import marginal
from rig_identification.estimate.swing_period import swing_period
from rig_identification.estimate.unseen_swing import SWING
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: rad, by which a camera leans, or a gyroscope is turned against the vertical: six degrees.
LEANS = 0.1
#: s, that a camera takes from a picture's first row to its last: what lies between two pictures of a film.
READ_OUT = 1.0 / 30.0
#: Height of the picture in widths of the line of hinges: a platform is filmed with a margin around it.
PICTURE = 2.0
#: Parts of a turn's period of which the samples are averaged before its rate is taken.
PARTS = 16.0
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
    """(N, n) what a channel may read at the nodes, each column for one std; None where nothing can swing.

    n: 8 of a camera, which reads a turn row by row; 5 of a gyroscope, which has no rows.
    """
    frequency = sway_frequency(rig)
    if frequency is None or not one_turn(run):
        return None
    nodes = run.grid.step * np.arange(run.grid.nodes, dtype=np.float64)
    angle = 2.0 * np.pi * frequency * nodes
    swing = SWING * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turn = _turn_of(channel, nodes)[:, None]
    shapes = np.concatenate([LEANS * swing, turn * swing, LEANS * (turn**2 - np.mean(turn**2))], axis=1)
    if channel.quantity == "angular_rate":
        return np.asarray(np.gradient(shapes, run.grid.step, axis=0))
    swung, turned = _read_later(rig)
    rate = _rate_of(channel, nodes, swing_period(run))[:, None]
    return np.concatenate([shapes, swung * rate * swing, turned * rate * turn], axis=1)


def _read_later(rig: Rig) -> tuple[float, float]:
    """(s, s) later that a camera reads a marker for each radian of swing, and of turn.

    A marker as far out as the hinges moves half their width for a radian of turn, a cable's length for one of
    swing.
    """
    wide = float(np.max(np.ptp([cable.body_point for cable in rig.cables], axis=0)))
    length = float(np.mean([cable.length for cable in rig.cables]))
    row = READ_OUT / (PICTURE * max(wide, 1e-3))
    return row * length, row * 0.5 * wide


def _rate_of(channel: Channel, nodes: Array, period: float) -> Array:
    """(N,) rad/s, the rate of the turn that a channel measures, through means of a part of its ``period``."""
    part = np.floor((channel.time - channel.time[0]) / (period / PARTS)).astype(np.int64)
    count = np.bincount(part)
    there = count > 0
    time, turn = (np.bincount(part, v)[there] / count[there] for v in (channel.time, channel.values[:, 0]))
    if time.size < 2:
        return np.zeros_like(nodes)
    return np.asarray(CubicSpline(time, turn)(np.clip(nodes, time[0], time[-1]), 1))


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
