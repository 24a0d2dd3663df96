"""Which witness lies: the model fitted without each device in turn.

An error of one device contradicts all others, which agree among themselves once it is not heard. Physics that
acts on the body leaves no device in peace.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.solve import POLISH, Evaluation, Point, Problem, excess, solve
from rig_identification.mismatch.budget import UNLIMITED, Budget

#: What drives the motion: a device that measures a force, which without it may be any.
DRIVE = "exciter"
#: Factor on a device's noise that silences it, and on the exciter's.
SILENT = 300.0
#: Share of the excess that has to go with a device for it to be the one that lies.
GONE = 0.97
#: Mean square of the other devices' residuals up to which they agree.
AGREED = 1.15
#: Steps of such a fit.
STEPS = 6


@dataclass(frozen=True)
class Liar:
    """A device without which everything else agrees."""

    device: str
    point: Point  # fitted without it
    left: float  # mean square of the other devices' residuals


def devices_of(problem: Problem) -> list[str]:
    """Devices whose readings, or force, the runs hold."""
    found = {c.device: None for run in problem.runs for c in run.channels}
    exciter = [DRIVE] if any(run.force is not None for run in problem.runs) else []
    return [*found, *exciter]


def silenced(problem: Problem, device: str) -> Problem:
    """The problem with one device's noise so large that it says nothing."""
    runs = []
    for run in problem.runs:
        channels = tuple(
            replace(c, noise=SILENT * c.noise) if c.device == device else c for c in run.channels
        )
        silent = replace(run, channels=channels)
        if device == DRIVE and run.force is not None:
            # A force of which nothing is known is another one in each interval
            rough = replace(run.force, cutoff=0.0)
            silent = replace(silent, force=rough, exciter_noise=SILENT * run.exciter_noise)
        runs.append(silent)
    rests = tuple(
        replace(
            rest,
            channels=tuple(
                replace(c, variance=SILENT**2 * c.variance) if c.device == device else c
                for c in rest.channels
            ),
        )
        for rest in problem.rests
    )
    return replace(problem, runs=tuple(runs), rests=rests)


#: Share of the excess that has to go with a device to first order for its fit to be tried.
GONE_LINEARLY = 0.6


def _gone_with(problem: Problem, evaluation: Evaluation, device: str) -> float:
    """Share of the excess that goes with a device to first order: its rows are left out, all else moves."""
    size = problem.bench.parameters.size
    information, gradient = evaluation.information.copy(), evaluation.gradient.copy()
    left, place_ = 0.0, size
    for run, part in zip(evaluation.runs, problem.runs, strict=True):
        starts = run.jacobian.shape[1] - size
        columns = np.concatenate([np.arange(size), np.arange(place_, place_ + starts)])
        place_ += starts
        mine = np.array([c.device == device for c in part.channels])[run.channel]
        rows = run.jacobian[mine]
        information[np.ix_(columns, columns)] -= rows.T @ rows
        gradient[columns] -= rows.T @ run.residual[mine]
        left += 0.5 * float(np.sum(run.residual[~mine] ** 2) - np.count_nonzero(~mine))
    # What only the device told moves no more than the silenced device lets it
    information += 1e-9 * np.diag(np.diag(evaluation.information))
    won = 0.5 * float(gradient @ np.linalg.lstsq(information, gradient, rcond=1e-14)[0])
    return 1.0 - max(0.0, left - won) / max(excess(evaluation), 1.0)


def find_liar(problem: Problem, evaluation: Evaluation, budget: Budget = UNLIMITED) -> Liar | None:
    """The device without which the others agree best, where nearly all excess goes with it.

    No further one is silenced once the ``budget`` is spent.
    """
    devices = devices_of(problem)
    if len(devices) < 3:
        return None
    best: Liar | None = None
    for device in devices:
        if budget.spent():
            break
        # The force is no row, it drives everything: only a fit tells
        if device != DRIVE and _gone_with(problem, evaluation, device) < GONE_LINEARLY:
            continue
        try:
            fitted, _ = solve(
                silenced(problem, device), evaluation.point, iterations=STEPS, tolerance=0.5, polish=POLISH
            )
        except FloatingPointError:
            continue
        heard = [
            run.residual[[part.channels[i].device != device for i in run.channel]]
            for run, part in zip(fitted.runs, problem.runs, strict=True)
        ]
        rest = np.concatenate(heard)
        if excess(fitted) < (1.0 - GONE) * excess(evaluation):
            left = float(np.mean(rest**2))
            if left < AGREED and (best is None or left < best.left):
                best = Liar(device, fitted.point, left)
    return best
