"""What samples may be off by, and is integrated out: an unseen sway, a wandering bias, a pose error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.unseen_sway import sway_shapes
from rig_identification.estimate.wandering_bias import wander_shapes
from rig_identification.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Unseen:
    """Shapes of one axis of a channel, of which each has an amount with a unit normal prior."""

    channel: int  # index into run.channels
    column: int  # of its values
    rows: NDArray[np.int64]  # (m,) its rows among the run's
    seen: Array  # (m, n) the shapes there, in units of the rows' noise
    at_nodes: Array  # (N, a) the first of them, in the channel's unit
    at_samples: Array  # (samples, n - a) ... and the others


def read_beside(rig: Rig, run: Run, channel: Channel) -> Array | None:
    """(N, n) what a device of one turn may read beside it, a std each: the sway, a bias that wanders.

    None where nothing can swing.
    """
    sway = sway_shapes(rig, run, channel)
    return None if sway is None else np.concatenate([sway, wander_shapes(run, channel)], axis=1)


def unseen_of(
    rig: Rig, swings: bool, run: Run, which: NDArray[np.int64], axis: NDArray[np.int64], variance: Array
) -> Iterator[Unseen]:
    """Each axis of each channel that may be off so.

    swings: whether nothing that was measured tells of a sway. which, axis (m,): channel and axis of each row;
    variance (m,): its noise.
    """
    for index, channel in enumerate(run.channels):
        sway = read_beside(rig, run, channel) if swings else None
        wander = channel.wander if index in run.pose_shapes else None
        if sway is None and wander is None:
            continue
        at_nodes = np.zeros((run.grid.nodes, 0)) if sway is None else sway
        value, _ = run.samplers[index].at(0.0)
        swaying = np.asarray(value @ at_nodes)
        for column, a in enumerate(channel.axes):
            rows = np.flatnonzero((which == index) & (axis == a))
            at_samples, grouped = np.zeros((channel.time.size, 0)), np.zeros((swaying.shape[0], 0))
            if wander is not None:
                at_samples, grouped = (wander[column] * shapes for shapes in run.pose_shapes[index])
            seen = np.concatenate([swaying, grouped], axis=1) / np.sqrt(variance[rows])[:, None]
            yield Unseen(index, column, rows, seen, at_nodes, at_samples)
