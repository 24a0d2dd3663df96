"""As much of long runs as a fit needs: cost grows with every second, accuracy hardly does.

A body's numbers come out of a fit with the doubts about its rig among them: of what 10 s leave, 250 s leave a
half to a tenth, and from there on lengths and hinge points decide, which no motion measures any better. A
fit's time and memory are in proportion to what it looks at. So all runs together are at most SECONDS long,
each its share; of a longer one the stretch is used in which it moves most, for a swing that has died away
tells nothing more. What is left out is told.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rig_identification.estimate.evidence import Run

#: Length of all fitted runs together, and of all held-out ones, s.
SECONDS = 250.0
#: The same where the body is only seen to swing: some twenty to fifty periods, in most of which a free swing
#: has died away. Each way to roll and each effect that damps is fitted to all of it.
WATCHED_SECONDS = 48.0
#: Devices that see how a body moves and not what moves it.
ONLY_SEE = {"mocap", "inclinometer"}


def enough(runs: tuple[Run, ...], most: float | None = None) -> tuple[Run, ...]:
    """The runs with at most about ``most`` seconds in all (none given: what the devices in them take)."""
    if most is None:
        seen = all(c.device in ONLY_SEE for run in runs for c in run.channels)
        most = WATCHED_SECONDS if seen else SECONDS
    total = sum(run.grid.duration for run in runs)
    if total <= 1.01 * most:
        return runs
    return tuple(
        replace(liveliest(run, most * run.grid.duration / total), out_of=run.grid.duration) for run in runs
    )


def told(runs: Iterable[Run]) -> tuple[str, ...]:
    """What is told of those of the ``runs`` that are the liveliest stretch of a longer one."""
    return tuple(
        f"{run.recording.name}: used from {run.offset:.1f} to {run.offset + run.grid.duration:.1f} s, where "
        f"it moves most; all of its {run.out_of:.0f} s would hardly tell more of the body."
        for run in runs
        if run.out_of > 0.0
    )


def liveliest(run: Run, seconds: float) -> Run:
    """The stretch of so many ``seconds`` in which the run's readings are farthest from their middles."""
    nodes = max(8, round(seconds / run.grid.step) + 1)
    if nodes >= run.grid.nodes:
        return run
    moved = np.zeros(run.grid.nodes)
    for channel in run.channels:
        away = (channel.grouped - np.median(channel.grouped, axis=0)) / channel.noise
        np.add.at(moved, channel.node, np.sum(away**2, axis=1))
    so_far = np.concatenate([[0.0], np.cumsum(moved)])
    begin = int(np.argmax(so_far[nodes:] - so_far[:-nodes]))
    return run.between(begin, begin + nodes - 1)
