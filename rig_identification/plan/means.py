"""What a lab has for a session: time, an exciter and its limits, room to swing, devices."""

from __future__ import annotations

from dataclasses import dataclass, field

from rig_identification.simulate import SampleRates

#: Names of exciters: an unbalanced mass on a motor, or one that gives any force.
MOTOR, SHAKER = "motor", "shaker"


@dataclass(frozen=True)
class Means:
    """Limits that every planned run keeps."""

    minutes: float = 5.0  # in all, at rest, held out and changeovers included
    exciter: str = MOTOR
    force: float = 0.05  # largest force of the exciter, share of the weight
    pull: float = 0.06  # largest pull aside before a release, share of the weight
    highest: float = 2.0  # Hz, of the exciter
    travel: float = 0.15  # m, that any hinge on the body may move away from rest
    taut: float = 0.1  # share of its tension at rest that each cable keeps
    rest: float = 10.0  # s, of a recording at rest
    changeover: float = 0.0  # s that each further recording takes before it begins
    rates: SampleRates = field(default_factory=SampleRates)

    @property
    def block(self) -> float:
        """Length of the pieces that runs are put together of, s."""
        return 20.0 if self.minutes >= 2.0 else 10.0
