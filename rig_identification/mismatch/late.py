"""A clock that is off beside a device that follows slowly: alike to first order.

A first-order lag predicts the device's reading from a smoothed motion, and smoothing the noise of the
exciter's force predicts better whatever the device does (in_motion.py). Only what is gained where the body
moves tells a lag from a clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.in_motion import cost_in_motion
from rig_identification.mismatch.opened import Promise

if TYPE_CHECKING:
    from rig_identification.mismatch.trial import Trial

#: What a run's start brings with it (s): what a lagging device showed before is not known.
SETTLING = 1.0


def lag_like(clock: Trial, candidates: Sequence[Candidate]) -> Promise | None:
    """The lag of the device whose clock a trial finds late; None where it finds none late."""
    if clock.candidate.effect != "clock_offset":
        return None
    late = clock.values[clock.candidate.parameters[0].name]
    channel = clock.candidate.where.get("channel")
    for lag in candidates:
        if late > 0.0 and lag.effect == "sensor_lag" and lag.where.get("channel") == channel:
            return Promise(lag, 0.0, {lag.parameters[0].name: late})
    return None


def told_apart(done: Sequence[Trial], meant: float) -> list[Trial]:
    """Trials, most likely first, a lag before a clock only where the motion says so.

    Late cells are alike to an exciter that is early. meant: nats that count. Between the two the gap is what
    the motion tells.
    """
    out = list(done)
    clocks = [t for t in done if t.candidate.effect == "clock_offset"]
    for i, lag in enumerate(done):
        if lag.candidate.effect != "sensor_lag":
            continue
        heard = cost_in_motion(lag.problem, lag.evaluation, SETTLING)
        for clock in sorted(clocks, key=lambda t: t.evidence):
            gain = cost_in_motion(clock.problem, clock.evaluation, SETTLING) - heard
            if gain < meant:
                # A clock is an ordinary doubt of every rig, a lag is not
                out[i] = replace(lag, evidence=clock.evidence - max(0.0, -gain))
            elif lag.evidence < clock.evidence and lag.candidate.where == clock.candidate.where:
                # What the device showed before a piece began is open: that costs the lag, and says nothing
                out[i] = replace(lag, evidence=clock.evidence + gain)
    return sorted(out, key=lambda t: (-t.evidence, t.candidate.effect == "sensor_lag"))
