"""How long an answer may take: past it nothing new is begun, what is begun ends, what is found is told."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from rig_identification.model import compiling

#: Seconds after which no further effect is begun, and no hypothesis fitted any further. What comes after,
#: whole runs with what was found and a stand-in for what was not, takes up to a minute.
SECONDS = 120.0
#: Seconds after which whole runs are fitted no further either: what has not settled by then is not told.
LATEST = 150.0
#: Seconds of compiling, at most, that do not count.
FORGIVEN = 90.0


@dataclass(frozen=True)
class Budget:
    """Time of an answer, from when it is made; the model's compiling does not count (compiling.py)."""

    seconds: float = SECONDS
    begun: float = field(default_factory=time.monotonic)
    compiled: float = field(default_factory=compiling.seconds)  # before

    def elapsed(self) -> float:
        """Seconds so far, as they count."""
        return time.monotonic() - self.begun - min(compiling.seconds() - self.compiled, FORGIVEN)

    def spent(self) -> bool:
        """Whether the time is over; a hypothesis' fit asks between its steps."""
        return self.elapsed() > self.seconds

    def late(self) -> bool:
        """Whether what was found has to be told as it is; a fit of whole runs asks between its steps."""
        return self.elapsed() > self.seconds + LATEST - SECONDS


#: For a fit that nothing but its own end ends.
UNLIMITED = Budget(float("inf"))
