"""What the formulas of the textbooks make of the same runs: bifilar, trifilar, any number of alike threads.

A body on n threads of length L, its hinges at distances r_i from their middle and the ceiling's at R_i above
them, turns about the vertical with (for instance Jardin & Mueller, Journal of Aircraft 46, 2009, for two)
    J = m g sum(R_i r_i) / (n h w0^2),     h^2 = L^2 - (R - r)^2.
With p = mean of R_i r_i a turn by a needs the moment m g p/h sin(a) / sqrt(1 - 2 p (1 - cos a) / h^2), and
the body rises by p/h (1 - cos a): a swing of amplitude A takes longer by the share
    kappa A^2,   kappa = 3/8 (1/6 - p / (2 h^2)) + p w0^2 / (4 g h).
The formula takes the body's centre of mass to hang midway, and counts all that moves along, the stirred air
for one, as the body's.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.alike_threads import AlikeThreads, alike_threads
from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import seen_pose
from rig_identification.estimate.free_swing import FreeSwing, free_swing
from rig_identification.estimate.solve import Problem
from rig_identification.quantity import with_interval
from rig_identification.result import InertialEstimate, TextbookAnswer

Array = NDArray[np.float64]

UNIT = "kg*m^2"
#: Names of the formulas by the number of threads.
NAMES = {2: "bifilar", 3: "trifilar"}
#: rad, of the widest turn, below which a line about the vertical may be what leaks from swinging beside: half
#: a degree. Who times a turning sets it off by degrees.
TURNED = 0.01
#: What the formula knows nothing of, on any rig.
LEAVES_OUT = (
    "a centre of mass beside the middle of the threads (Jzz falls by the share e²/r²)",
    "what damps the turning, and the air that turns along",
    "errors of the described lengths and distances that the swing itself shows",
)


def textbook_answers(problem: Problem, body: InertialEstimate) -> tuple[TextbookAnswer, ...]:
    """The formula's inertia about the vertical from the fitted runs; nothing where none is for such a rig.

    body: as fitted, of which the mass is taken where no scale told it.
    """
    threads = alike_threads(problem.bench.rig)
    seen = [] if threads is None else _free_turns(problem, threads)
    if threads is None or not seen:
        return ()
    mass = problem.mass or (float(body.values[0]), float(np.sqrt(body.covariance[0, 0])))
    return (_answer(threads, mass, problem.bench.rig.gravity, seen),)


def turning_inertia(problem: Problem, mass: float) -> float | None:
    """kg m2 about the vertical by the formula; None where none is for such a rig or run. mass: kg."""
    threads = alike_threads(problem.bench.rig)
    seen = [] if threads is None else _free_turns(problem, threads)
    if threads is None or not seen:
        return None
    return _inertia(threads, mass, problem.bench.rig.gravity, _common(seen)[0])


def _inertia(threads: AlikeThreads, mass: float, gravity: float, frequency: float) -> float:
    return mass * gravity * threads.product / (threads.height * frequency**2)


def _free_turns(problem: Problem, threads: AlikeThreads) -> list[FreeSwing]:
    """Swings about the vertical of the runs without an exciter; none where nobody set the body turning."""
    free = [run for run in problem.runs if run.force is None]
    seen = [swing for run in free for swing in _turns(problem, run, threads)]
    return seen if seen and max(swing.amplitude for swing in seen) >= TURNED else []


def _answer(
    threads: AlikeThreads, mass: tuple[float, float], gravity: float, seen: list[FreeSwing]
) -> TextbookAnswer:
    frequency, std = _common(seen)
    value = _inertia(threads, mass[0], gravity, frequency)
    shares = {
        "period": value * 2.0 * std / frequency,
        "mass": value * mass[1] / mass[0],
        "distances": value * threads.product_share,
        "length": value * threads.height_share,
    }
    total = float(np.sqrt(sum(share**2 for share in shares.values())))
    name = NAMES.get(threads.count, f"{threads.count}-thread")
    period = 2.0 * np.pi / frequency
    widest = max(swing.amplitude for swing in seen)
    longer = _kappa(threads, gravity, frequency) * widest**2
    text = (
        f"The {name} formula J = m g R r / (h ω²) makes Jzz {with_interval(value, total, UNIT)} of a "
        f"period of {with_interval(period, period * std / frequency, 's')} at small turns. At the widest "
        f"turn, {np.degrees(widest):.2g}°, a swing takes {100.0 * longer:.2g} % longer, which is taken off."
    )
    return TextbookAnswer(
        name,
        "Jzz",
        float(value),
        total,
        UNIT,
        float(period),
        float(period * std / frequency),
        float(widest),
        float(np.mean([swing.decay for swing in seen])),
        {key: float(share) for key, share in shares.items()},
        text,
        LEAVES_OUT,
    )


def _kappa(threads: AlikeThreads, gravity: float, frequency: float) -> float:
    """By what share a swing takes longer, 1/rad^2 of its amplitude."""
    p, h = threads.product, threads.height
    return 3.0 / 8.0 * (1.0 / 6.0 - 0.5 * p / h**2) + 0.25 * p * frequency**2 / (gravity * h)


def _turns(problem: Problem, run: Run, threads: AlikeThreads) -> Iterator[FreeSwing]:
    """The run's swing about the vertical by each device that sees it."""
    gravity = problem.bench.rig.gravity
    for time, values, rate in _signals(problem, run):
        rough = free_swing(time, values, 0.0, rate=rate)
        if rough is None:
            continue
        swing = free_swing(time, values, _kappa(threads, gravity, rough.frequency), rate=rate)
        if swing is not None and swing.frequency_std < 0.1 * swing.frequency:
            yield swing
            return


def _signals(problem: Problem, run: Run) -> Iterator[tuple[Array, Array, bool]]:
    """(time, turn about the vertical or its rate, whether it is the rate) of each device that sees it."""
    pose, mount = seen_pose(run), problem.bench.mocap
    if pose is not None and run.R_tracker_mean is not None and pose.known[5]:
        up = np.array([0.0, 0.0, 1.0]) if mount is None else mount.R_tracker_world[:, 2]
        yield pose.time, pose.turn @ (run.R_tracker_mean.T @ up), False
    imu = problem.bench.rig.imu
    for c in run.channels:
        if c.quantity == "angular_rate" and 2 in c.axes and imu is not None:
            rates = np.zeros((c.time.size, 3))
            rates[:, list(c.axes)] = c.values
            yield c.time, Rotation.from_quat(imu.orientation).apply(rates)[:, 2], True


def _common(seen: list[FreeSwing]) -> tuple[float, float]:
    """Mean frequency (rad/s) of several swings and its std, as large as they differ where that is more."""
    frequency = np.array([swing.frequency for swing in seen])
    weight = 1.0 / np.array([max(swing.frequency_std, 1e-9 * swing.frequency) for swing in seen]) ** 2
    mean = float(np.average(frequency, weights=weight))
    own = float(1.0 / np.sum(weight))
    apart = float(np.average((frequency - mean) ** 2, weights=weight)) / max(1, len(seen) - 1)
    return mean, float(np.sqrt(max(own, apart)))
