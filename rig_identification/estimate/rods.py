"""Cables that push: what a rig hangs on says itself whether it is rope or rod.

A rope stops at nothing and hangs loose; a rod goes on below it. The description does not say which it is,
and its load cells do as soon as it matters: a model of ropes lets go where a rod pushes, and everything
after that moment is another motion.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rig_identification.estimate.evidence import Channel, Run
from rig_identification.model.motion import RigModel
from rig_identification.rig import Rig

#: A cell reads nothing where it reads less than so many std of its noise and tolerance of its zero.
NOTHING = 4.0
#: So many samples of a run must read nothing: one or two are glitches. A cable that snaps rings, and may be
#: loose for no more than a sample at a time.
FEW = 5


def reads_nothing(channel: Channel, zero: float) -> float:
    """Tension (N) below which a cell reads nothing. zero: tolerance of a cell's zero, N."""
    return NOTHING * float(np.hypot(channel.noise[0], zero))


def pushes(channel: Channel, zero: float) -> bool:
    """Whether a cable pulls less than nothing for longer than it pulls nothing. zero: see reads_nothing."""
    limit, tension = reads_nothing(channel, zero), channel.values[:, 0]
    below = int(np.count_nonzero(tension < -limit))
    return below >= FEW and 2 * below > int(np.count_nonzero(tension < limit))


def rods_of(rig: Rig, runs: Iterable[Run]) -> tuple[str, ...]:
    """Names of the cables that push in any of ``runs``, in the order of the rig."""
    zero = rig.tolerance["load_cell_zero"]
    found = {c.device for run in runs for c in run.channels if c.quantity == "tension" and pushes(c, zero)}
    return tuple(cable.name for cable in rig.cables if cable.name in found)


def with_rods(model: RigModel, rig: Rig, rods: tuple[str, ...]) -> RigModel:
    """The model in which the cables ``rods`` do not let go."""
    held = np.array([cable.name in rods for cable in rig.cables])
    return replace(model, can_slacken=model.can_slacken & ~held)


def note_of(rods: tuple[str, ...]) -> str:
    """What the report says of them."""
    names = " and ".join(rods)
    return f"{names} read less than nothing for a while: taken as rods that push, not as ropes that go slack."
