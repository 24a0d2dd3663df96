"""A clock that is off beside a device that follows slowly: alike to first order.

A first-order lag predicts the device's reading from a smoothed motion. The measured force of the
exciter is noisy, the true one is not, and smoothing it predicts better whatever the device does. That
gain lies at frequencies where nothing but noise is; only what is gained where the body moves tells a
lag from a clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rig_identification.estimate.solve import Evaluation, Problem

if TYPE_CHECKING:
    from rig_identification.mismatch.trial import Trial

#: Highest frequency (Hz) of the motion: an exciter of such rigs turns below 2.5 Hz.
MOVING = 4.0
#: What a run's start brings with it (s): what a lagging device showed before is not known.
SETTLING = 1.0


def cost_in_motion(problem: Problem, evaluation: Evaluation) -> float:
    """Half the sum of squares (nats) of the whitened residuals at frequencies at which the body moves."""
    total = 0.0
    for run, linearised in zip(problem.runs, evaluation.runs, strict=True):
        for index, channel in enumerate(run.channels):
            for axis in range(channel.width):
                residual = linearised.residual[(linearised.channel == index) & (linearised.axis == axis)]
                step = run.grid.duration / max(residual.size, 1)
                calm = residual[min(int(SETTLING / step), residual.size // 2) :]
                if calm.size < 4:
                    continue
                power = np.abs(np.fft.rfft(calm)) ** 2 / calm.size
                moving = np.fft.rfftfreq(calm.size, step) < MOVING
                total += float(np.sum(power[moving]))
    return total


def told_apart(done: Sequence[Trial], meant: float) -> list[Trial]:
    """Trials, most likely first, a lag before a clock of the same device only where the motion says so.

    meant: nats that count. Between the two the gap is what the motion tells.
    """
    out = list(done)
    for i, lag in enumerate(done):
        for k, clock in enumerate(done):
            if (lag.candidate.effect, clock.candidate.effect) != ("sensor_lag", "clock_offset"):
                continue
            if lag.candidate.where.get("channel") != clock.candidate.where.get("channel"):
                continue
            heard = cost_in_motion(lag.problem, lag.evaluation)
            gain = cost_in_motion(clock.problem, clock.evaluation) - heard
            if gain < meant:
                # A clock is an ordinary doubt of every rig, a lag is not
                best = max(lag.evidence, clock.evidence)
                out[k] = replace(clock, evidence=best)
                out[i] = replace(lag, evidence=best - max(0.0, -gain))
    return sorted(out, key=lambda t: (-t.evidence, t.candidate.effect == "sensor_lag"))
