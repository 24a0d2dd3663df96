"""Maximum a posteriori estimate: Gauss-Newton on everything at once, damped where a step does not pay.

Cost = 1/2 |whitened residuals|^2 + log spreads + 1/2 |(theta - prior)/std|^2. The residuals of
each run come whitened (whitening.py), so J^T J is the Fisher information and its inverse the
Laplace covariance (MacKay, "Information Theory, Inference, and Learning Algorithms", ch. 27).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.estimate.prediction import (
    START_UNIT,
    Bench,
    Linearised,
    linearise_run,
    model_at,
    start_basis,
)
from rig_identification.estimate.rest_evidence import (
    RestEvidence,
    RestLinearised,
    linearise_rest,
    with_dummy,
)
from rig_identification.model import layout
from rig_identification.model.equilibrium import settle
from rig_identification.model.motion import State, on_cables

Array = NDArray[np.float64]


#: Where an internal coordinate may start (m) and how fast (m/s): one standard deviation about its rest.
INTERNAL_START = (0.1, 0.3)
#: No entry of the log-Cholesky vector moves further in one step, in units of its weak prior's std.
LONGEST_STEP = 0.5


@dataclass(frozen=True)
class Problem:
    """What is fitted to what."""

    bench: Bench
    runs: tuple[Run, ...]
    rests: tuple[RestEvidence, ...]
    mass: tuple[float, float] | None  # ground scale: value and std, kg
    weak: Array  # (10,) std of a weak prior on the log-Cholesky vector about ``weak_center``
    weak_center: Array  # (10,)
    bound: float = np.inf  # free parameters stay within so many of their prior std
    stride: float = LONGEST_STEP  # longest step of the body, in std of the weak prior
    extra_noise: Array | None = None  # (6, 6) random wrench over a node interval: what the model lacks


@dataclass(frozen=True)
class Point:
    """A value of every unknown."""

    theta: Array
    starts: tuple[State, ...]  # one a run
    rest_guesses: tuple[State, ...]  # one a static recording
    latents: tuple[Array | None, ...] = ()  # (N, 6) a run: see linearise_run; empty: none


@dataclass(frozen=True)
class Evaluation:
    """The problem linearised at a point."""

    point: Point
    runs: tuple[Linearised, ...]
    rests: tuple[RestLinearised, ...]
    cost: float
    information: Array  # (p + starts, p + starts), data and priors
    prior_information: Array  # (p,) diagonal that priors alone contribute
    gradient: Array  # (p + starts,) of the negative cost


def _prior(problem: Problem, theta: Array) -> tuple[float, Array, Array]:
    """(cost, information (p, p), negative gradient (p,)) of tolerances, weak prior and ground scale."""
    p = problem.bench.parameters.size
    deviation = theta.copy()
    deviation[:INERTIAL] = (theta[:INERTIAL] - problem.weak_center) / problem.weak
    weight = np.ones(p)
    weight[:INERTIAL] = 1.0 / problem.weak**2
    information = np.diag(weight)
    gradient = -theta.copy()
    gradient[:INERTIAL] = -deviation[:INERTIAL] / problem.weak
    cost = 0.5 * float(deviation @ deviation)
    if problem.mass is not None:
        value, std = problem.mass
        elements = problem.bench.parameters.elements(theta)
        row = problem.bench.parameters.elements_jacobian(theta)[0] / std
        miss = (value - elements[0]) / std
        cost += 0.5 * miss**2
        information[:INERTIAL, :INERTIAL] += np.outer(row, row)
        gradient[:INERTIAL] += row * miss
    return cost, information, gradient


def evaluate(problem: Problem, point: Point) -> Evaluation | None:
    """Linearise everything at ``point``; None where a run or a rest pose cannot be computed."""
    bench = problem.bench
    latents = point.latents or (None,) * len(problem.runs)

    def one(item: tuple[Run, State, Array | None]) -> Linearised | None:
        run, start, latent = item
        return linearise_run(bench, run, point.theta, start, extra_noise=problem.extra_noise, latent=latent)

    with ThreadPoolExecutor(max_workers=2) as pool:
        runs = list(pool.map(one, zip(problem.runs, point.starts, latents, strict=True)))
    if any(r is None for r in runs):
        return None
    rests = []
    for evidence, guess in zip(problem.rests, point.rest_guesses, strict=True):
        rest = linearise_rest(bench, evidence, point.theta, guess)
        if rest is None:
            model = with_dummy(model_at(bench.parameters, point.theta), evidence.dummy)
            rest = linearise_rest(bench, evidence, point.theta, settle(model, guess))
        if rest is None:
            return None
        rests.append(rest)
    return _assemble(problem, point, tuple(r for r in runs if r is not None), tuple(rests))


def _assemble(
    problem: Problem, point: Point, runs: tuple[Linearised, ...], rests: tuple[RestLinearised, ...]
) -> Evaluation:
    p = problem.bench.parameters.size
    cost, prior, prior_gradient = _prior(problem, point.theta)
    total = p + sum(r.jacobian.shape[1] - p for r in runs)
    inner = model_at(problem.bench.parameters, point.theta).states - layout.BODY_STATE
    information, gradient = np.zeros((total, total)), np.zeros(total)
    information[:p, :p] = prior
    gradient[:p] = prior_gradient
    place = p
    for run, start in zip(runs, point.starts, strict=True):
        starts = run.jacobian.shape[1] - p
        columns = np.concatenate([np.arange(p), np.arange(place, place + starts)])
        if inner:
            # Nothing else may tell where a mass that hardly shows starts from
            last = np.arange(place + starts - inner, place + starts)
            spread = np.repeat(INTERNAL_START, inner // 2)
            away = start.vector(layout.BODY_STATE + inner)[layout.BODY_STATE :]
            information[last, last] += (START_UNIT / spread) ** 2
            gradient[last] -= START_UNIT * away / spread**2
            cost += 0.5 * float(np.sum((away / spread) ** 2))
        information[np.ix_(columns, columns)] += run.jacobian.T @ run.jacobian
        gradient[columns] += run.jacobian.T @ run.residual
        cost += run.cost
        place += starts
    for rest in rests:
        information[:p, :p] += rest.jacobian.T @ rest.jacobian
        gradient[:p] += rest.jacobian.T @ rest.residual
        cost += rest.cost
    return Evaluation(point, runs, rests, cost, information, np.diag(prior).copy(), gradient)


def _moved(problem: Problem, evaluation: Evaluation, change: Array) -> Point:
    p = problem.bench.parameters.size
    theta = problem.bench.parameters.moved(evaluation.point.theta, change[:p])
    old = model_at(problem.bench.parameters, evaluation.point.theta)
    new = model_at(problem.bench.parameters, theta)
    starts, place = [], p
    for state in evaluation.point.starts:
        basis = start_basis(old, state)
        own = change[place : place + basis.shape[1]]
        starts.append(on_cables(new, state.moved(basis @ own)))
        place += basis.shape[1]
    guesses = tuple(rest.rest.state for rest in evaluation.rests)
    return Point(theta, tuple(starts), guesses, evaluation.point.latents)


def _bounded_step(problem: Problem, current: Evaluation, damping: float) -> Array:
    """Damped Gauss-Newton step that keeps the free parameters within their bound.

    The body moves by no more than the problem's stride; everything else then takes the step
    that is best with the body where it got to.
    """
    information = current.information + damping * np.diag(np.diag(current.information))
    change = np.zeros(information.shape[0])
    fixed = np.zeros(information.shape[0], dtype=bool)
    change = _step_within_bounds(problem, current, information, change, fixed)
    longest = float(np.max(np.abs(change[:INERTIAL]) / problem.weak))
    if longest <= problem.stride:
        return change
    shortened = np.zeros_like(change)
    shortened[:INERTIAL] = change[:INERTIAL] * problem.stride / longest
    fixed[:INERTIAL] = True
    return _step_within_bounds(problem, current, information, shortened, fixed)


def _step_within_bounds(
    problem: Problem, current: Evaluation, information: Array, change: Array, fixed: NDArray[np.bool_]
) -> Array:
    """Newton step of all that is not ``fixed``, which makes the ``change`` given.

    Active set: a parameter that the step would carry past its bound goes onto it, and the
    others are solved for again with that move made (Nocedal & Wright, "Numerical
    Optimization", section 16.7).
    """
    p = problem.bench.parameters.size
    theta = current.point.theta
    limit = np.array([_limit(problem, q) for q in problem.bench.parameters.free])
    change, fixed = change.copy(), fixed.copy()
    for _ in range(20):
        open_ = np.flatnonzero(~fixed)
        held = np.flatnonzero(fixed)
        right = current.gradient[open_] - information[np.ix_(open_, held)] @ change[held]
        change[open_] = np.linalg.solve(information[np.ix_(open_, open_)], right)
        reached = np.zeros_like(fixed)
        target = theta[INERTIAL:p] + change[INERTIAL:p]
        reached[INERTIAL:p] = (np.abs(target) > limit + 1e-9) & ~fixed[INERTIAL:p]
        if not np.any(reached):
            break
        beyond = np.flatnonzero(reached)
        change[beyond] = np.sign(theta[beyond] + change[beyond]) * limit[beyond - INERTIAL] - theta[beyond]
        fixed |= reached
    return change


#: No positive number leaves so many std of its logarithm's prior.
WIDEST = 3.0


def _limit(problem: Problem, parameter: Parameter) -> float:
    """Std of its prior that a free parameter stays within."""
    if parameter.ratio:
        return WIDEST
    return problem.bound if parameter.bounded else np.inf


#: Mean square of the whitened residuals above which a fit explains nothing.
HOPELESS = 100.0
#: Share of what noise does not account for below which a step's gain is not worth taking: a model
#: that lacks something has no optimum worth polishing.
POLISH = 3e-3
#: Gain (nats) of a step that gets nowhere, and how many of them in a row end a fit.
CREEP, CREPT = 0.01, 4


def excess(evaluation: Evaluation) -> float:
    """Cost (nats) beyond what noise alone would leave."""
    residuals = np.concatenate([np.zeros(0), *(run.residual for run in evaluation.runs)])
    return max(0.0, 0.5 * float(residuals @ residuals - residuals.size))


def on_plateau(evaluation: Evaluation) -> bool:
    """Whether nothing fits, and the body is so large or small that the recordings no longer feel it.

    They do not where they say less of an entry of its vector than the weak prior does.
    """
    residual = np.concatenate([np.zeros(1), *(run.residual for run in evaluation.runs)])
    told = np.diag(evaluation.information)[:INERTIAL]
    vague = told < 2.0 * evaluation.prior_information[:INERTIAL]
    # The mass is known from the scale, whatever the motion says
    return bool(np.mean(residual**2) > HOPELESS and np.any(vague[1:]))


def solve(
    problem: Problem,
    point: Point,
    *,
    iterations: int = 30,
    tolerance: float = 1e-3,
    polish: float = 0.0,
    notify: Callable[[int, float], None] | None = None,
) -> tuple[Evaluation, bool]:
    """Minimise from ``point``: (last evaluation, whether it converged).

    Converged where the predicted gain of a full step falls below ``tolerance`` (nats): the
    estimate is then within sqrt(2 tolerance) of its own standard deviation from the optimum. Where
    a step won less than ``polish`` of what stays unexplained, the fit ends there as well: a
    hypothesis that leaves much is not worth following down every valley. Steps that win next to nothing,
    one after the other, end it too, unconverged: along bounds a valley may be followed for ever.
    A plateau, where nothing fits and nothing answers any more, does not count.
    """
    current = evaluate(problem, point)
    if current is None:
        raise FloatingPointError("the forward model cannot be evaluated at the first guess")
    damping, creeping = 1e-6, 0
    for iteration in range(iterations):
        while True:
            change = _bounded_step(problem, current, damping)
            gain = 0.5 * float(change @ current.gradient)
            if gain < tolerance and damping <= 1e-3:
                return current, not on_plateau(current)
            trial = evaluate(problem, _moved(problem, current, change))
            if trial is not None and trial.cost < current.cost + 1e-9 * abs(current.cost):
                damping = max(damping * 0.1, 1e-9)
                won, current = current.cost - trial.cost, trial
                creeping = creeping + 1 if won < CREEP else 0
                if creeping == CREPT:
                    return current, False
                if max(won, tolerance) < polish * excess(current) and damping <= 1e-3:
                    return current, not on_plateau(current)
                break
            damping = max(damping, 1e-6) * 10.0
            if damping > 1e6:
                return current, False
        if notify is not None:
            notify(iteration, current.cost)
    return current, False


def fit_start(
    bench: Bench,
    run: Run,
    theta: Array,
    start: State,
    *,
    iterations: int = 20,
    tolerance: float = 1e-3,
    extra_noise: Array | None = None,
    spread: float = np.inf,
) -> tuple[Linearised, State] | None:
    """The run's own start state alone, everything else held: what a held-out run may be given.

    extra_noise (6, 6): see :func:`linearise_run`. spread: std of a prior on the start about
    ``start`` (m, rad; twice as much m/s, rad/s).
    """
    p = bench.parameters.size
    model = model_at(bench.parameters, theta)

    def attempt(state: State) -> Linearised | None:
        return linearise_run(bench, run, theta, state, start_only=True, extra_noise=extra_noise)

    current = attempt(start)
    if current is None:
        return None
    damping, moved_so_far = 1e-9, np.zeros(current.jacobian.shape[1] - p)
    dof = moved_so_far.size // 2
    weight = (START_UNIT / spread / np.repeat([1.0, 2.0], dof)) ** 2
    for _ in range(iterations):
        columns = current.jacobian[:, p:]
        information = columns.T @ columns + np.diag(weight)
        gradient = columns.T @ current.residual - weight * moved_so_far
        damped = information + damping * np.diag(np.diag(information))
        change = np.linalg.lstsq(damped, gradient, rcond=1e-12)[0]
        if 0.5 * float(change @ gradient) < tolerance:
            break
        moved = on_cables(model, start.moved(start_basis(model, start) @ change))
        trial = attempt(moved)
        further = moved_so_far + change
        prior_change = 0.5 * float(weight @ (further**2 - moved_so_far**2))
        if trial is not None and trial.cost + prior_change < current.cost + 1e-9 * abs(current.cost):
            current, start, moved_so_far, damping = trial, moved, further, max(damping * 0.1, 1e-12)
        else:
            damping = max(damping, 1e-6) * 10.0
            if damping > 1e6:
                break
    return current, start


def shortened(problem: Problem, end: float) -> Problem:
    """The same problem on the first ``end`` seconds of every run."""
    return replace(problem, runs=tuple(run.until(end) for run in problem.runs))
