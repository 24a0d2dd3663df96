"""Where a recording's other devices put a stream in time: by receive times, or by start and end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.stamps.streams import GROUND_TRUTH, SECOND, Stream, copied
from rig_identification.raw import Stamps

Array = NDArray[np.float64]

#: s. Devices of one recording start and end within this of each other, and are received within this of their
#: stamps: a recorder subscribes in tenths of a second, and messages wait no longer in queues.
ORDINARY = 0.5
#: Part of a stream's receive times that lies within those of the others where one recorder wrote them.
_WITHIN = 0.5


def received_together(one: Stream, others: list[Stream]) -> bool:
    """Whether one recorder's clock gave the receive times of a stream and of the others.

    They then cover the same time. Copies of stamps from another clock do not, nor do times of a conversion.
    """
    if not others:
        return False
    own = one.received
    span = int(own.max() - own.min())
    if span <= 0 or np.mean(np.diff(own) < 0) > 0.5:
        return False
    low = int(np.median([other.received.min() for other in others]))
    high = int(np.median([other.received.max() for other in others]))
    shared = min(int(own.max()), high) - max(int(own.min()), low)
    return shared > _WITHIN * min(span, high - low) and high > low


def steady(one: Stream) -> bool:
    """Whether stamps and receive times keep one distance: no step, no other rate."""
    ahead = (one.stamps - one.received).astype(np.float64) / SECOND
    parts = [float(np.median(part)) for part in np.array_split(ahead, 10)]
    return max(parts) - min(parts) < ORDINARY / 2.0


def latency(stamps: Stamps, received: Stamps) -> float:
    """Shortest usual time (s) from stamp to receipt: the tenth of the samples that were received soonest."""
    return float(np.quantile((received - stamps).astype(np.float64), 0.1)) / SECOND


@dataclass(frozen=True)
class Placement:
    """By how much a stream's stamps lie after the others' clock."""

    offset: float  # s
    std: float  # s
    received: bool  # by receive times


def placement(one: Stream, others: list[Stream], recorded: Stream) -> Placement | None:
    """Offset of a stream's stamps against those of ``others``, which share a clock; None: untold.

    recorded: the stream as it stands in the file, whose receive times may be copies of its stamps.
    """
    others = [other for other in others if other.device != GROUND_TRUTH] or others
    if not others:
        return None
    if not copied(recorded.channel) and steady(one) and received_together(one, others):
        usual = [latency(other.stamps, other.received) for other in others]
        middle = float(np.median(usual))
        spread = float(np.median(np.abs(np.array(usual) - middle))) * 1.5
        return Placement(middle - latency(one.stamps, one.received), max(spread, 1e-3), True)
    return by_ends(one, others)


def by_ends(one: Stream, others: list[Stream]) -> Placement:
    """Offset that puts a stream's middle on that of the others."""
    first, last = (int(np.median([f(other.stamps) for other in others])) for f in (np.min, np.max))
    start, end = float(one.stamps.min() - first), float(one.stamps.max() - last)
    return Placement((start + end) / 2.0 / SECOND, max(abs(end - start) / 2.0 / SECOND, 0.02), False)
