"""How long a search may take: past it nothing new is begun, and what is found so far is told."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

#: Seconds after which a search begins no further effect, and fits nothing more that changes the model.
SECONDS = 120.0


@dataclass(frozen=True)
class Budget:
    """Time of a search, from when it is made."""

    seconds: float = SECONDS
    begun: float = field(default_factory=time.monotonic)

    @property
    def spent(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() - self.begun > self.seconds
