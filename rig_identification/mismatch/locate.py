"""Which witness lies: the model fitted without each device in turn, and without each stretch of time.

An error of one device contradicts all others, which agree among themselves once it is not
heard. A push contradicts everything for a moment, and nothing before and after. Physics that acts on the
body all the time leaves no such subset in peace.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rig_identification.estimate.growing import misfit, settled_starts
from rig_identification.estimate.solve import POLISH, Evaluation, Point, Problem, evaluate, excess, solve
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


@dataclass(frozen=True)
class Event:
    """A stretch of one recording in which something acts that the rest of it does not show."""

    recording: str
    start: float  # s after the recording's start
    end: float  # s
    point: Point  # fitted without it, for all pieces
    calm: tuple[int, ...]  # pieces that it leaves in peace


#: An event may take up this share of the pieces. It shows in them by so many standard deviations of a mean
#: square beyond noise; beside something else, by so many times what that leaves.
EVENT_SHARE = 0.4
EVENT_SEEN = 6.0
EVENT_CONTRAST = 3.0
#: Mean square of the calm pieces' residuals up to which they count as explained.
CALM = 1.15


@dataclass(frozen=True)
class Calm:
    """The pieces that fit best, fitted without the others."""

    keep: tuple[int, ...]
    fitted: Evaluation


def calm_pieces(problem: Problem, evaluation: Evaluation) -> Calm | None:
    """Those of a problem's pieces that an event would leave in peace; None where there are too few."""
    count = len(problem.runs)
    if count < 4:
        return None
    order = np.argsort([float(np.mean(run.residual**2)) for run in evaluation.runs])
    keep = sorted(int(i) for i in order[: count - int(EVENT_SHARE * count)])
    part = replace(problem, runs=tuple(problem.runs[i] for i in keep))
    point = replace(evaluation.point, starts=tuple(evaluation.point.starts[i] for i in keep), latents=())
    # Steps that win next to nothing of what is left do not bring these pieces to noise either
    fitted, _ = solve(part, point, iterations=10, tolerance=0.5, polish=POLISH)
    return Calm(tuple(keep), fitted)


def find_event(
    problem: Problem, evaluation: Evaluation, alone: bool = True, calm: Calm | None = None
) -> Event | None:
    """Pieces that cannot be fitted, next to each other in one run; None where there are no such.

    alone: all other pieces are explained. Otherwise something else is wrong in these, alike in all of
    them, before the event and after it. calm: the :func:`calm_pieces`, where they are known.
    """
    calm = calm or calm_pieces(problem, evaluation)
    if calm is None or (alone and misfit(calm.fitted) > CALM):
        return None
    count, keep, fitted = len(problem.runs), list(calm.keep), calm.fitted
    starts = list(evaluation.point.starts)
    for i, start in zip(keep, fitted.point.starts, strict=True):
        starts[i] = start
    point = replace(fitted.point, starts=tuple(starts), latents=())
    # Pieces that were not fitted start as suits the calm ones' body
    point = replace(point, starts=settled_starts(problem, point))
    whole = evaluate(problem, point)
    if whole is None:
        return None
    squares = np.array([float(np.mean(run.residual**2)) for run in whole.runs])
    if alone:
        sizes = np.array([run.residual.size for run in whole.runs])
        limit = np.mean(squares[keep]) + EVENT_SEEN * np.sqrt(2.0 / sizes)
    else:
        limit = np.full(count, EVENT_CONTRAST * max(CALM, float(np.max(squares[keep]))))
    bad = [i for i in range(count) if squares[i] > limit[i]]
    names = {problem.runs[i].recording.name for i in bad}
    if not bad or len(names) > 1 or bad != list(range(bad[0], bad[-1] + 1)):
        return None
    event = event_in(problem, bad, point)
    return None if not alone and at_an_end(event, problem) else event


def event_in(problem: Problem, bad: list[int], point: Point) -> Event:
    """The event that takes the pieces ``bad`` of one recording, next to each other."""
    first, last = problem.runs[bad[0]], problem.runs[bad[-1]]
    calm = tuple(i for i in range(len(problem.runs)) if i not in bad)
    return Event(first.recording.name, first.offset, last.offset + last.grid.duration, point, calm)


def at_an_end(event: Event, problem: Problem) -> bool:
    """Whether an event takes a recording's first or last piece: what dies away, or grows, does so too."""
    within = [i for i, run in enumerate(problem.runs) if run.recording.name == event.recording]
    return within[0] not in event.calm or within[-1] not in event.calm
