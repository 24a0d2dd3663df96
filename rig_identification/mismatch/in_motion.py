"""What a hypothesis gains where the body moves, and what it gains from noise alone.

The exciter's measured force is noisy, the true one is not: whatever lets less of that noise through to the
cables or to a reading predicts better, a low-pass in a sensor or a part that yields at some hertz. The gain
is real and says nothing of the rig. It lies at frequencies at which the ideal model leaves noise and no
more, and of that there is nothing to explain.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.prediction import Linearised
from rig_identification.estimate.solve import Evaluation, Problem

Array = NDArray[np.float64]

#: Highest frequency (Hz) of the motion: an exciter of such rigs turns below 2.5 Hz.
MOVING = 4.0


def _cost(
    runs: Sequence[Run],
    linearised: Sequence[Linearised],
    residuals: Sequence[Array],
    chosen: Callable[[Array], NDArray[np.bool_]],
    settling: float = 0.0,
) -> tuple[float, float]:
    """Half the sum of squares (nats) at the chosen frequencies (Hz), and what white noise's would be.

    residuals (m,): whitened, in the rows of ``linearised``.
    """
    total, white = 0.0, 0.0
    for run, rows, residual in zip(runs, linearised, residuals, strict=True):
        for index, channel in enumerate(run.channels):
            for axis in channel.axes:
                own = residual[(rows.channel == index) & (rows.axis == axis)]
                step = run.grid.duration / max(own.size, 1)
                calm = own[min(int(settling / step), own.size // 2) :]
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
    residuals = [run.residual for run in evaluation.runs]
    return _cost(problem.runs, evaluation.runs, residuals, lambda f: f < MOVING, settling)[0]


def _fast(frequency: Array) -> NDArray[np.bool_]:
    return np.asarray(frequency >= MOVING)


def unearned(problem: Problem, before: Evaluation, after: Sequence[Linearised]) -> float:
    """Nats of the runs' gain over ``before`` that no motion and no excess of residuals accounts for.

    after: the same runs with a hypothesis in the model.
    """
    spread = sum(run.log_spread for run in before.runs) - sum(run.log_spread for run in after)
    return unearned_of(problem, before, after, [run.residual for run in after], spread)


def unearned_of(
    problem: Problem,
    before: Evaluation,
    rows: Sequence[Linearised],
    residuals: Sequence[Array],
    spread: float = 0.0,
) -> float:
    """The same of ``residuals``, in the rows of ``rows``. spread: nats gained in their log spreads.

    What explains an excess leaves less of it in units of the noise. Less noise alone leaves as much of those,
    and by chance there is always some excess.
    """
    old = [run.residual for run in before.runs]
    beyond, white = _cost(problem.runs, before.runs, old, _fast)
    fallen = beyond - _cost(problem.runs, rows, residuals, _fast)[0]
    return max(0.0, spread + fallen - max(0.0, min(beyond - white, fallen)))
