"""Estimator (d): this project's output-error fit, given what the thesis gives its own.

The thesis knows mass and centre of mass and asks for the tensor alone; so does this fit: the
body's other four numbers are held, and there is no doubt about rig and sensors. The start
state of the run is free, and horizons grow from a tenth of a second, so that the first guess may
be the thesis' own or any other. Where a guess leads nowhere the fit starts from the momentum
regression, as ``identify`` always does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import NODE_STEP, Run, prepare
from rig_identification.estimate.parameters import INERTIAL, DeviceLayout, ParameterSet
from rig_identification.estimate.prediction import Bench
from rig_identification.estimate.solve import Evaluation, Point, Problem, shortened, solve
from rig_identification.model.body import tensor
from rig_identification.model.motion import State
from rig_identification.recording import Recording, Series
from rig_identification.simulate.thesis_case import NOISE
from rig_identification.thesis.case import Case
from rig_identification.thesis_rerun.motion import STEP, CaseMotion, case_elements

Array = NDArray[np.float64]

#: Std of the weak prior on the logarithmic inertia, and of what is held (mass, centre of mass).
WEAK, HELD = 3.0, 1e-10
#: Horizons, s, that lead up to the whole window.
HORIZONS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
#: Std of the weak prior while horizons grow: what a short one does not see stays near the guess.
GROWING_WEAK = 0.5
#: Horizon, s, from which a fit must settle, and the residual, in sigma, that it must settle to.
JUDGED, SETTLED = 1.0, 1.5
#: Entries of the log-Cholesky vector that hold mass and centre of mass (model/body.py).
HELD_ENTRIES = (0, 7, 8, 9)


@dataclass(frozen=True)
class TensorFit:
    """What (d) ended with."""

    inertia: Array  # (3, 3) kg m^2
    converged: bool
    begun: str  # "guess" or "momentum": what the fit that is reported started from
    seconds: float  # of motion that it was fitted to


def noise_free_run(motion: CaseMotion, window: tuple[float, float], *, force: bool = True) -> Run:
    """Tensions, IMU at the centre of mass and inclinometer at the thesis' sampling instants in ``window``, s.

    A sample at the very instant of a jump has no one value and is left out. ``force`` False: the
    exciter's force is not among the recordings.
    """
    case = motion.case
    chosen = np.setdiff1d(motion.samples(window), motion.jumps)
    time = motion.time[chosen] - window[0]
    up = motion.R_world_body[chosen, 2]
    first, last = (round(edge / STEP) for edge in window)
    nodes = np.arange(first, min(last, motion.time.size - 1) + 1)
    recording = Recording(
        name=f"case_{case.label}",
        kind="dynamic",
        holdout=False,
        start_ns=0,
        duration=float(window[1] - window[0]),
        tension={
            cable.name: Series(time, motion.tension[chosen, i : i + 1])
            for i, cable in enumerate(case.rig.cables)
        },
        exciter_force=Series(motion.time[nodes] - window[0], motion.held_force[nodes]) if force else None,
        imu=Series(time, np.concatenate([motion.rate[chosen], motion.specific_force[chosen]], axis=1)),
        inclination=Series(time, np.arcsin(up[:, :2])),
    )
    # Samples without noise tell the finest nodes from wider ones
    return prepare(case.rig, recording, NODE_STEP)


def tensor_problem(motion: CaseMotion, runs: tuple[Run, ...], guess: Array) -> tuple[Problem, Array]:
    """The fit of six elements to ``runs``, and the vector of ``guess`` (3, 3)."""
    case = motion.case
    places = DeviceLayout(tuple(cable.name for cable in case.rig.cables))
    parameters = ParameterSet(motion.model, places, ())
    theta = parameters.start(case_elements(case, nearest_body(guess)))
    weak = np.full(INERTIAL, WEAK)
    weak[list(HELD_ENTRIES)] = HELD
    return Problem(Bench(case.rig, parameters), runs, (), None, weak, theta.copy()), theta


def state_at(motion: CaseMotion, time: float) -> State:
    """State at a node."""
    k = round(time / STEP)
    return State(motion.position[k], motion.R_world_body[k], motion.velocity[k], motion.rate[k])


def nearest_body(guess: Array) -> Array:
    """(3, 3) ``guess`` blended with the sphere of its trace until a body can have it.

    The thesis' first guesses for cases 1 and 3 to 9 are no body's: their largest principal
    moment exceeds the sum of the other two.
    """
    sphere = np.trace(guess) / 3.0 * np.eye(3)
    for share in np.linspace(0.0, 1.0, 41):
        blend = (1.0 - share) * guess + share * sphere
        moments = np.linalg.eigvalsh(blend)
        if moments[0] > 0.0 and moments[0] + moments[1] > 1.02 * moments[2]:
            return np.asarray(blend)
    return np.asarray(sphere)


def solve_over_horizons(problem: Problem, point: Point) -> tuple[Evaluation, bool]:
    """Fit over growing horizons; (evaluation of what was reached, whether all converged)."""
    whole = max(run.grid.duration for run in problem.runs)
    roughly = replace(problem, weak=np.where(problem.weak > HELD, GROWING_WEAK, HELD))
    for end in (h for h in HORIZONS if h < 0.7 * whole):
        evaluation, converged = solve(shortened(roughly, end), point, iterations=20, tolerance=0.5)
        if end >= JUDGED and not (converged and _rms(evaluation) < SETTLED):
            return evaluation, False
        point = evaluation.point
    evaluation, converged = solve(problem, point, iterations=20, tolerance=1e-5)
    return evaluation, converged and _rms(evaluation) < SETTLED


def _rms(evaluation: Evaluation) -> float:
    return float(np.sqrt(np.mean(np.concatenate([run.residual for run in evaluation.runs]) ** 2)))


def fit_tensor(
    motion: CaseMotion, window: tuple[float, float], guess: Array, regression: Array | None = None
) -> TensorFit:
    """Fit the tensor to one window, s, from a first guess (3, 3) kg m^2, else from ``regression`` (3, 3)."""
    run = noise_free_run(motion, window)
    start = (state_at(motion, window[0]),)
    guesses = {"guess": guess} | ({} if regression is None else {"momentum": regression})
    for name, first in guesses.items():
        begun = name
        problem, theta = tensor_problem(motion, (run,), first)
        evaluation, converged = solve_over_horizons(problem, Point(theta, start, ()))
        if converged:
            break
    found = problem.bench.parameters.elements(evaluation.point.theta)
    return TensorFit(tensor(found[4:]), converged, begun, run.grid.duration)


def with_noise(case: Case) -> Case:
    """The case with a rig description that states its sensors' noise as weights; the force is exact."""
    return replace(case, rig=replace(case.rig, noise=NOISE | {"exciter_force": 0.0}))
