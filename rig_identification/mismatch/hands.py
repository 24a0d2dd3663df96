"""The part of a watched run in which a person holds or drives the body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from rig_identification.estimate.evidence import Run, prepare
from rig_identification.estimate.first_guess import seen_pose
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.start_state import fit_start
from rig_identification.mismatch.findings import written
from rig_identification.mismatch.trial import NORMAL_95
from rig_identification.quantity import plain_figure
from rig_identification.recording import Recording
from rig_identification.result import Finding

Array = NDArray[np.float64]

#: Window over which acceleration is read off the recorded path, s.
WINDOW = 0.5
#: s of free motion that a held part is followed with, and mean square up to which both are noise together.
BEHIND, NOISE = 6.0, 1.2


def _pull(run: Run, gravity: float, length: float) -> tuple[Array, Array] | None:
    """(time (n,), acceleration (n, 2) m/s^2) that gravity on cables of ``length`` does not account for."""
    place = seen_pose(run)
    if place is None or not np.all(place.known[:2]):
        return None
    step = float(np.median(np.diff(place.time)))
    window = max(5, 2 * int(0.5 * WINDOW / step) + 1)
    if place.time.size < window:
        return None
    even = np.arange(place.time[0], place.time[-1], step)
    path = np.stack([np.interp(even, place.time, v) for v in place.position.T[:2]], axis=1)
    acceleration = savgol_filter(path, window, 3, deriv=2, delta=step, axis=0)
    calm = savgol_filter(path, window, 3, axis=0)
    return even, acceleration + gravity / length * (calm - np.mean(calm, axis=0))


def _recordings(fitted: Fitted) -> dict[str, Recording]:
    """Every dynamic recording, whole, by name."""
    runs = (*fitted.problem.runs, *fitted.holdout_runs, *fitted.lost)
    return {run.recording.name: run.recording for run in runs}


def nobody_held(fitted: Fitted) -> bool:
    """Whether the model follows what was cut off as a person's hand as well as what it was fitted to.

    What stops a swing within seconds looks like a hand to a model without it.
    """
    problem, theta = fitted.problem, fitted.evaluation.point.theta
    recordings = _recordings(fitted)
    for part in fitted.held_parts:
        run = prepare(problem.bench.rig, recordings[part.recording])
        first, last = (round(end / run.grid.step) for end in (part.start, part.end + BEHIND))
        run = run.between(max(first, 0), last)
        found = fit_start(problem.bench, run, theta, launch_state(problem.bench, run, theta, fitted.rest))
        if found is None or float(np.mean(found[0].residual ** 2)) > NOISE:
            return False
    return True


def hand_finding(fitted: Fitted) -> Finding | None:
    """Finding ``external_force`` for the parts that were cut off; None where none were, or no force shows.

    The force is what the marker's path asks of a pendulum of the cables' length beyond gravity; its
    std is what the same measure reads in the free part, where no one pushes. What does not exceed that, or
    where no place was measured, tells of no force: the parts stand in the notes alone.
    """
    if not fitted.held_parts:
        return None
    rig, elements = fitted.problem.bench.rig, fitted.problem.bench.parameters
    mass = float(elements.elements(fitted.evaluation.point.theta)[0])
    length = float(np.mean([c.length for c in rig.cables]))
    peak, calm = 0.0, []
    for name, recording in _recordings(fitted).items():
        found = _pull(prepare(rig, recording), rig.gravity, length)
        if found is None:
            continue
        time, missing = found
        force = mass * np.hypot(missing[:, 0], missing[:, 1])
        held = np.zeros(time.size, dtype=bool)
        mine = [part for part in fitted.held_parts if part.recording == name]
        for part in mine:
            held |= (time >= part.start) & (time <= part.end)
        if np.any(held):
            peak = max(peak, float(np.max(force[held])))
            free = time > max(part.end for part in mine)
            calm.append(force[free])
    level = float(np.sqrt(np.mean(np.concatenate(calm) ** 2))) if calm else peak
    if peak <= NORMAL_95 * level:
        return None
    times = [{"recording": p.recording, "start": p.start, "end": p.end} for p in fitted.held_parts]
    told = "; ".join(f"{p.recording} {p.start:.1f} to {p.end:.1f} s" for p in fitted.held_parts)
    return Finding(
        "external_force",
        {"channel": None, "axis": None, "times": times},
        written({"peak_force": (peak, level, "N")}),
        {"log_likelihood_gain": None, "holdout_error_before": None, "holdout_error_after": None},
        f"A person's hand or another outside force drives the body ({told}), "
        f"with up to {plain_figure(peak, 2)} N. "
        "These parts were left out; let go before the recording that counts.",
    )
