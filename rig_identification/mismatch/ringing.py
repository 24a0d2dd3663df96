"""Moments after a blow in which sensors ring as no body on rigid cables does.

A blow on the body may stretch the cables for some milliseconds, and load cells and accelerometers ring with
them. Those samples say next to nothing of the blow: taken for the body's motion they make a blow along the
floor one along the cables. What the body's rates and angles are before and after says what it was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.evidence import Run
from rig_identification.mismatch.slack import shocks

#: What rings, and how long (s) before and after a shock: two nodes, and a few periods of a cable's ringing.
RINGS = ("tension", "specific_force")
BEFORE, AFTER = 0.01, 0.06
#: Least share of a channel's samples to keep: a channel that always rings is left as it is.
CALM = 0.5


def without_ringing(run: Run) -> Run:
    """The run without the samples that may ring after blows; itself where there are none."""
    spells = shocks(run)
    channels = []
    for c in run.channels:
        kept = np.ones(c.time.size, dtype=bool)
        if c.quantity in RINGS:
            time = c.time + run.offset
            for shock in spells:
                kept &= (time < shock.start - BEFORE) | (time > shock.end + AFTER)
        rings = not np.all(kept) and np.mean(kept) >= CALM
        channels.append(c.keeping(kept, run.grid) if rings else c)
    if all(calm is c for calm, c in zip(channels, run.channels, strict=True)):
        return run
    return replace(run, channels=tuple(channels))
