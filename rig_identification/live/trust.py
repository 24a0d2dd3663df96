"""When a measurement is not believed, and when the state is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from scipy.special import chdtri

#: A measurement less probable than this is not believed; so many in a row, and the state is not.
IMPROBABLE, DISBELIEVED = 1e-4, 3


@dataclass
class Trust:
    """How often in a row a kind of measurement contradicted the state."""

    size: int  # components
    refused: int = 0
    believed_ns: int = 0
    limit: float = field(init=False)  # of a surprise: chi-square, above it a measurement is not believed

    def __post_init__(self) -> None:
        """Set the limit."""
        self.limit = float(chdtri(self.size, IMPROBABLE))

    def begin(self, stamp_ns: int) -> None:
        """State and measurements agree."""
        self.refused, self.believed_ns = 0, stamp_ns

    def contradicted(self, stamp_ns: int, update: Callable[[float], float]) -> bool:
        """Use a measurement unless it surprises too much; whether so many did that the state is at fault.

        update: takes a limit; returns the surprise, and changes nothing where that is above the limit.
        """
        if update(self.limit) <= self.limit:
            self.begin(stamp_ns)
            return False
        self.refused += 1
        return self.refused >= DISBELIEVED
