"""Zeros that move by more than such devices' do: of one quantity, in each recording and along it.

A gyroscope that warms up, a bridge in the sun, an amplifier that was switched off in between: each axis has
another zero in each recording, and moves along it, by no law that one recording tells of the next one. Every
device's zeros do so by a part of their tolerance, which is integrated out (estimate/wander.py). Here those of
one quantity may do so a hundred times as far, integrated out alike: nothing is fitted, and what a mean and a
line along a recording cannot account for is left. So it is told only where everything else is noise, in runs
that were held out too.

It is asked after all else. Zeros that move freely take slow physics with them: what pulls on the body
steadily, or changes it between recordings, is found by what it does to all devices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Channel, Run
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Ideal, fitted_anew, judged, near_noise
from rig_identification.estimate.prediction import Linearised
from rig_identification.estimate.solve import Problem, evaluate, excess
from rig_identification.estimate.wander import ZEROS, wander_of
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.explained import Explained, evidence_of, held_out_errors
from rig_identification.mismatch.findings import written
from rig_identification.quantity import with_interval
from rig_identification.result import Finding, Mismatch

Array = NDArray[np.float64]
Notify = Callable[[str, float], None]

#: Share of the fitted runs' excess that free zeros have to take away before anything is fitted anew.
CHIEF = 0.5
#: Std of every device's wander beyond which an axis is told.
BEYOND = 5.0
#: Word and number of the recording contract for each quantity's zero.
NAMES = {
    "tension": ("load_cell_offset", "offset", "N"),
    "angular_rate": ("imu_bias", "angular_rate", "rad/s"),
    "specific_force": ("imu_bias", "specific_force", "m/s^2"),
    "inclination": ("inclinometer_offset", "offset", "rad"),
}


def wandering_zeros(ideal: Ideal, notify: Notify, budget: Budget) -> Explained | None:
    """What explains the session where one quantity's zeros move further than they may; None: nothing does."""
    if budget.late():
        return None
    fitted = ideal.fitted
    measured = {c.quantity for run in fitted.problem.runs for c in run.channels}
    takes = {q: _takes(fitted, q) for q in ZEROS if q in measured}
    if not takes:
        return None
    quantity = max(takes, key=lambda q: takes[q])
    if takes[quantity] < CHIEF * excess(fitted.evaluation):
        return None
    notify(f"search: zeros of {quantity.replace('_', ' ')} that move", 0.94)
    free = _freed(ideal, quantity, notify)
    if free is None or free.mismatch.verdict != "none":
        return None
    return _told(ideal, free, quantity)


def _with_free_zeros(problem: Problem, quantity: str) -> Problem:
    """The problem with the zeros of one quantity free to move."""
    return replace(problem, bench=replace(problem.bench, freed=quantity))


def _takes(fitted: Fitted, quantity: str) -> float:
    """Nats that free zeros of a quantity take away from the fitted runs, everything else as it was fitted."""
    freed = evaluate(_with_free_zeros(fitted.problem, quantity), fitted.evaluation.point)
    return -np.inf if freed is None else float(fitted.evaluation.cost - freed.cost)


def _freed(ideal: Ideal, quantity: str, notify: Notify) -> Ideal | None:
    """The ideal model fitted with the zeros of a quantity free to move; None where it cannot be followed."""
    fitted = ideal.fitted
    problem = _with_free_zeros(fitted.problem, quantity)
    point = replace(fitted.evaluation.point, latents=())
    held = (*fitted.holdout_runs, *fitted.lost)
    try:
        again = fitted_anew(fitted, problem, point, held, notify)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None
    return Ideal(again, *judged(again)) if near_noise(again) else None


def _told(ideal: Ideal, free: Ideal, quantity: str) -> Explained | None:
    """The explanation with the zeros of a quantity free; None where none of them is far off."""
    evidence = evidence_of(ideal, free.fitted, free.scores.holdout)
    rig = ideal.fitted.problem.bench.rig
    found = [
        replace(_finding(device, axis, quantity, moves), evidence=evidence)
        for (device, axis), moves in sorted(
            _moves(free.fitted, quantity).items(), key=_farthest, reverse=True
        )
        if _farthest((device, moves)) > BEYOND * wander_of(rig, quantity)
    ]
    if not found:
        return None
    errors = held_out_errors(ideal.scores.holdout, free.scores.holdout)
    what = quantity.replace("_", " ")
    text = f"With zeros of the {what} that move in and between recordings every residual is noise. {errors}"
    return Explained(free.fitted, Mismatch("explained", text, tuple(found), ()), ideal)


def _farthest(of: tuple[object, list[Move]]) -> float:
    """How far off an axis' zero is at most, in any recording."""
    return max(abs(off) for off, _, _ in of[1])


#: Of one recording: by how much a zero is off at most, its std, and the recording's name.
Move = tuple[float, float, str]


def _moves(fitted: Fitted, quantity: str) -> dict[tuple[str, str | None], list[Move]]:
    """How far each axis' zero is off in each recording, beside where it is at rest."""
    out: dict[tuple[str, str | None], list[Move]] = {}
    pairs = [
        *zip(fitted.problem.runs, fitted.evaluation.runs, strict=True),
        *zip(fitted.holdout_runs, fitted.holdouts, strict=True),
    ]
    for run, seen in pairs:
        for index, channel in enumerate(run.channels):
            if channel.quantity != quantity:
                continue
            for axis in channel.axes:
                move = _move(run, channel, seen, index, axis)
                out.setdefault((channel.device, channel.axis_name(axis)), []).append(move)
    return out


def _move(run: Run, channel: Channel, seen: Linearised, index: int, axis: int) -> Move:
    """Where a line through what an axis reads beyond its prediction is farthest off."""
    rows = (seen.channel == index) & (seen.axis == axis)
    time = run.grid.step * seen.nodes[rows]
    line, covariance = np.polyfit(time, seen.plain[rows], 1, cov=True)
    ends = np.array([0.0, run.grid.duration])
    off = np.polyval(line, ends)
    last = int(np.argmax(np.abs(off)))
    at = np.array([ends[last], 1.0])
    return float(off[last]), float(np.sqrt(at @ covariance @ at)), run.recording.name


def _finding(device: str, axis: str | None, quantity: str, moves: list[Move]) -> Finding:
    """One axis' zero in words and numbers."""
    effect, number, unit = NAMES[quantity]
    off, std, _ = max(moves, key=lambda m: abs(m[0]))
    each = ", ".join(f"{with_interval(m, s, unit)} in {name}" for m, s, name in moves)
    which = f"{quantity.replace('_', ' ')} {axis or ''}".strip()
    text = (
        f"The zero of {device}'s {which} moves, beside where it is at rest: {each} at most. "
        "Let it warm up before recording, and zero it then."
    )
    where: dict[str, object] = {"channel": device, "axis": axis, "quantity": quantity}
    return Finding(effect, where, written({number: (off, std, unit)}), {}, text)
