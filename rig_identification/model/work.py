"""Work of an answer, counted: the same on any machine, idle or busy, on one core and on several.

Whoever computes something that takes time adds what it computed (:func:`add`), in columns carried over nodes.
Whole numbers are added, so that the order in which tasks on several cores end does not show in the sum.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

#: What is counted is a column carried over a node of a run: integrated, read and filtered. A core takes 0.9
#: to 1.0 microseconds for it: three recordings of 32 s at 100 Hz, 12 states, 70 to 180 columns. Whatever else
#: takes time is weighed to the same, so that a unit of work is about a second of one core.
UNIT = 1_000_000
#: Units of work after which no further effect is begun, and no hypothesis fitted any further: under three
#: minutes of two cores. Measured on three whole answers (two runs of 32 s each; hinges that damp, a cell's
#: gain, a hose) are 83, 50 and 82 units, 0.69, 0.94 and 0.71 a second of a core that others used as well,
#: which makes it a tenth slower. The search keeps one and a half of two cores busy: 1.25 units a second.
WORK = 200.0
#: Share of an answer's work that whole runs with what was found, and a stand-in for what was not, may take
#: beyond: half a minute. What has not settled by then is not told.
BEYOND = 0.25


class Meter:
    """What was computed since the meter was made; tasks on several threads may add to it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sum = 0

    def add(self, amount: int) -> None:
        """Count ``amount`` as done."""
        with self._lock:
            self._sum += amount

    @property
    def done(self) -> int:
        """All that was counted."""
        return self._sum


_METER: ContextVar[Meter | None] = ContextVar("meter", default=None)


@contextmanager
def counted() -> Iterator[Meter]:
    """Count what is computed within the block into a meter of its own, and into no other.

    It holds for this thread and for the tasks that it puts side by side (estimate/side_by_side.py).
    """
    meter = Meter()
    token = _METER.set(meter)
    try:
        yield meter
    finally:
        _METER.reset(token)


def add(amount: int) -> None:
    """Count ``amount`` as done; outside of :func:`counted` nobody asks, and nothing is counted."""
    meter = _METER.get()
    if meter is not None:
        meter.add(amount)


def meter() -> Meter:
    """The meter at work; outside of :func:`counted` one that stays at zero."""
    return _METER.get() or Meter()
