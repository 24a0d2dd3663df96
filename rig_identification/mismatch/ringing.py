"""Moments after a blow in which sensors ring as no body on rigid cables does.

A blow on the body may stretch the cables for some milliseconds, and load cells and accelerometers ring with
them. Those samples say next to nothing of the blow: taken for the body's motion they make a blow along the
floor one along the cables. What the body's rates and angles are before and after says what it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.sampling import group_by_node
from rig_identification.mismatch.slack import shocks

#: What rings, and how long (s) before and after a shock: two nodes, and a few periods of a cable's ringing.
RINGS = ("tension", "specific_force")
BEFORE, AFTER = 0.01, 0.06
#: Least share of a channel's samples to keep: a channel that always rings is left as it is.
CALM = 0.5


def without_ringing(run: Run) -> Run:
    """The run without the samples that may ring after blows."""
    spells = shocks(run)
    channels = []
    for c in run.channels:
        kept = np.ones(c.time.size, dtype=bool)
        if c.quantity in RINGS:
            time = c.time + run.offset
            for shock in spells:
                kept &= (time < shock.start - BEFORE) | (time > shock.end + AFTER)
        if np.mean(kept) < CALM or np.all(kept):
            channels.append(c)
            continue
        group, node = group_by_node(run.grid, c.time[kept])
        channels.append(replace(c, time=c.time[kept], values=c.values[kept], group=group, node=node))
    return replace(run, channels=tuple(channels))
