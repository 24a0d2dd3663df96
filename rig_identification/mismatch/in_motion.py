"""What a hypothesis gains where the body moves, and what it gains from noise alone.

The exciter's measured force is noisy, the true one is not: whatever lets less of that noise through to the
cables or to a reading predicts better, a low-pass in a sensor or a part that yields at some hertz. The gain is
real and says nothing of the rig. It lies at frequencies at which the ideal model leaves noise and no more,
and of that there is nothing to explain.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.solve import Evaluation, Problem

Array = NDArray[np.float64]

#: Highest frequency (Hz) of the motion: an exciter of such rigs turns below 2.5 Hz.
MOVING = 4.0


def _cost(
    problem: Problem, evaluation: Evaluation, chosen: Callable[[Array], NDArray[np.bool_]], settling: float
) -> tuple[float, float]:
    """Half the sum of squares (nats) at the chosen frequencies (Hz), and what white noise's would be."""
    total, white = 0.0, 0.0
    for run, linearised in zip(problem.runs, evaluation.runs, strict=True):
        for index, channel in enumerate(run.channels):
            for axis in range(channel.width):
                residual = linearised.residual[(linearised.channel == index) & (linearised.axis == axis)]
                step = run.grid.duration / max(residual.size, 1)
                calm = residual[min(int(settling / step), residual.size // 2) :]
                if calm.size < 4:
                    continue
                lines = np.fft.rfft(calm)
                weight = np.full(lines.size, 1.0)
                weight[0] = 0.5
                if calm.size % 2 == 0:
                    weight[-1] = 0.5
                kept = weight * chosen(np.asarray(np.fft.rfftfreq(calm.size, step)))
                total += float(kept @ (np.abs(lines) ** 2)) / calm.size
                white += float(np.sum(kept))
    return total, white


def cost_in_motion(problem: Problem, evaluation: Evaluation, settling: float = 0.0) -> float:
    """Half the sum of squares (nats) of the whitened residuals at frequencies at which the body moves.

    settling: s at the start of each run that do not count.
    """
    return _cost(problem, evaluation, lambda f: f < MOVING, settling)[0]


def unearned(
    problem: Problem, before: Evaluation, extended: Problem, after: Evaluation
) -> float:
    """Nats of what ``after`` gains over ``before`` that no motion and no excess of residuals accounts for.

    problem, extended: those that the two evaluations are of, on the same runs.
    """
    slow = cost_in_motion(problem, before) - cost_in_motion(extended, after)
    fast = (before.cost - after.cost) - slow
    beyond, white = _cost(problem, before, lambda f: f >= MOVING, 0.0)
    return max(0.0, fast - max(0.0, beyond - white))
