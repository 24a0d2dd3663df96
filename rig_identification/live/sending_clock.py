"""When messages were sent, by the clock of the machine that they came to.

A lost packet holds back all that its sender sent after it on that topic, for as long as the middleware
takes to ask for it again: seconds, on a busy machine, and each topic for itself. By arrival such samples
belong to the next recording, and the one that they were taken in lacks its end. The middleware stamps each
message twice, at its publisher and at its reader. The least that the second ever lies behind the first is
the difference of two machines' clocks and the shortest way; what a message takes longer it was held back.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.live.stamp_gate import SECOND

Stamps = NDArray[np.int64]

#: s over which the least is taken, and the part of it that is forgotten at once: clocks are set now and then.
HORIZON, SLOT = 30, 5


class SendingClock:
    """Sending times of one topic's messages."""

    def __init__(self) -> None:
        self._least: dict[int, int] = {}  # ns, of each slot of received time

    def times(self, source_ns: Stamps, received_ns: Stamps) -> Stamps:
        """(n,) ns, receiver's clock, when messages were sent.

        source_ns, received_ns: (n,) the middleware's stamps, in the order of arrival; a source stamp that is
        zero is none, and the message counts as sent when it was received.
        """
        if not len(source_ns):
            return np.zeros(0, np.int64)
        stamped = source_ns > 0
        behind = received_ns - source_ns
        slots = received_ns // (SLOT * SECOND)
        for slot in np.unique(slots[stamped]).tolist():
            least = int(np.min(behind[stamped & (slots == slot)]))
            self._least[slot] = min(least, self._least.get(slot, least))
        newest = int(slots[-1])
        self._least = {k: v for k, v in self._least.items() if newest - k <= HORIZON // SLOT}
        shortest = min(self._least.values(), default=0)
        return np.asarray(np.where(stamped, source_ns + shortest, received_ns))
