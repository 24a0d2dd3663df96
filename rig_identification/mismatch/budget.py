"""How much an answer may compute: past it nothing new is begun, what is begun ends, what is found is told.

Work is counted (model/work.py) and no clock is asked, so that an answer is the same on every machine.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from rig_identification.model import work
from rig_identification.model.work import BEYOND, WORK, Meter


@dataclass
class Budget:
    """Work of an answer, from when it is made; see :func:`rig_identification.model.work.counted`."""

    limit: float = WORK  # in units of work
    meter: Meter = field(default_factory=work.meter)
    untried: list[str] = field(default_factory=list)  # what would still have been begun
    begun: int = field(init=False)  # what the meter showed

    def __post_init__(self) -> None:
        self.begun = self.meter.done

    @property
    def used(self) -> float:
        """Units of work so far."""
        return (self.meter.done - self.begun) / work.UNIT

    def spent(self) -> bool:
        """Whether the work is done; a hypothesis' fit asks between its steps."""
        return self.used >= self.limit

    def late(self) -> bool:
        """Whether what was found has to be told as it is; a fit of whole runs asks between its steps."""
        return self.used >= self.limit * (1.0 + BEYOND)

    def leave(self, labels: Iterable[str]) -> None:
        """Keep, once the work is done, the names of hypotheses that would still have been begun."""
        if self.spent():
            self.untried += [label for label in labels if label not in self.untried]


#: For a fit that nothing but its own end ends.
UNLIMITED = Budget(float("inf"))
