"""How a device's zero wanders within a run, where one turn about the vertical, or its rate, is all measured.

The bias of a MEMS gyroscope is no constant. Within minutes it wanders by its bias instability B, flicker
noise of one-sided density B^2 / (2 pi f) (IEEE Std 952, annex C): data sheets of the parts that fly state 10
to 100 degrees an hour. Where force or acceleration is measured as well, they bear the fit, and slow noise
shows at rest (noise_at_rest.py). Where one rate is all there is, a fit of minutes bends to it a swing that
nothing measures. Half-range cosines of frequencies k / (2 T) hold it over a run of T seconds, each with the
variance B^2 / (2 pi k) of its share of that density. They are integrated out of a run as an unseen sway is
(unseen.py), up to half the frequency of the turn itself: beyond, the samples' own noise is larger.

No camera's zero stands still either: a tripod creeps, light moves, and where a marker lies within its pixels
is told to some hundredths of one. An angle as it reads it wanders by as much, with the same spectrum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.swing_period import swing_period

Array = NDArray[np.float64]

#: rad/s, bias instability of a small gyroscope: sixty degrees an hour.
INSTABILITY = 3e-4
#: rad, the same of an angle that a camera reads: three hundredths of a pixel, of which three hundred reach
#: from the middle to a marker.
CAMERA = 1e-4
#: Share of the turn's own frequency up to which the bias is told from it.
BELOW = 0.5


def wander_shapes(run: Run, channel: Channel) -> Array:
    """(N, k) rad/s, or rad of a camera, that a channel may read at the nodes, each column for one std.

    A run in which hardly half a turn is seen has none: nothing tells its bias from its motion.
    """
    nodes = run.grid.step * np.arange(run.grid.nodes, dtype=np.float64)
    instability = INSTABILITY if channel.quantity == "angular_rate" else CAMERA
    duration = max(run.grid.duration, run.grid.step)
    count = int(2.0 * duration * BELOW / swing_period(run))
    k = np.arange(1, count + 1)
    # A cosine of amplitude a has the variance a^2 / 2
    amplitude = instability / np.sqrt(np.pi * k)
    return np.asarray(amplitude * np.cos(np.pi * k * nodes[:, None] / duration))
