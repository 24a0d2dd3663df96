"""How a gyroscope's bias wanders within a run, where a rate about the vertical is all that is measured.

The bias of a MEMS gyroscope is no constant. Within minutes it wanders by its bias instability B, flicker
noise of one-sided density B^2 / (2 pi f) (IEEE Std 952, annex C): data sheets of the parts that fly state 10
to 100 degrees an hour. Where force or acceleration is measured as well, they bear the fit, and slow noise
shows at rest (noise_at_rest.py). Where one rate is all there is, a fit of minutes bends to it a swing that
nothing measures. Half-range cosines of frequencies k / (2 T) hold it over a run of T seconds, each with the
variance B^2 / (2 pi k) of its share of that density. They are integrated out of a run as an unseen sway is
(unseen.py), up to half the frequency of the turn itself: beyond, the samples' own noise is larger.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.swing_period import swing_period

Array = NDArray[np.float64]

#: rad/s, bias instability of a small gyroscope: sixty degrees an hour.
INSTABILITY = 3e-4
#: Share of the turn's own frequency up to which the bias is told from it.
BELOW = 0.5


def wander_shapes(run: Run, channel: Channel) -> Array:
    """(N, k) rad/s that a channel may read at the nodes, each column for one std; none of no gyroscope.

    A run in which hardly half a turn is seen has none: nothing tells its bias from its motion.
    """
    nodes = run.grid.step * np.arange(run.grid.nodes, dtype=np.float64)
    if channel.quantity != "angular_rate":
        return np.zeros((nodes.size, 0))
    duration = max(run.grid.duration, run.grid.step)
    count = int(2.0 * duration * BELOW / swing_period(run))
    k = np.arange(1, count + 1)
    # A cosine of amplitude a has the variance a^2 / 2
    amplitude = INSTABILITY / np.sqrt(np.pi * k)
    return np.asarray(amplitude * np.cos(np.pi * k * nodes[:, None] / duration))
