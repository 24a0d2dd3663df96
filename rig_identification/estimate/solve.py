"""Maximum a posteriori estimate: Gauss-Newton on everything at once, damped where a step does not pay.

Cost = 1/2 |whitened residuals|^2 + log spreads + 1/2 |(theta - prior)/std|^2. The residuals of
each run come whitened (whitening.py), so J^T J is the Fisher information and its inverse the
Laplace covariance (MacKay, "Information Theory, Inference, and Learning Algorithms", ch. 27).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.box import in_box
from rig_identification.estimate.evidence import Run
from rig_identification.estimate.force_noise import Discrepancy
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
from rig_identification.estimate.side_by_side import side_by_side
from rig_identification.estimate.unseen_swing import swing_belief
from rig_identification.model import layout
from rig_identification.model.definite import definite
from rig_identification.model.equilibrium import settle
from rig_identification.model.motion import State, on_cables

Array = NDArray[np.float64]


#: Swings in which a body falls to rest from where it hung a step before: what takes it farther is no step.
FALLS = 10
#: Where an internal coordinate may start (m) and how fast (m/s): one standard deviation about its rest.
INTERNAL_START = (0.1, 0.3)
#: No entry of the log-Cholesky vector moves further in one step, in units of its weak prior's std.
LONGEST_STEP = 0.5


@dataclass(frozen=True)
class Pin:
    """One of the ten elements, held at a value while all else is fitted."""

    element: int
    value: float
    std: float  # far less than anything tells of it


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
    discrepancy: Discrepancy | None = None  # ... as a wrench that goes on, at rest as well
    taken: tuple[int, ...] = ()  # entries of the weak prior that are believed (hung_by_eye.py)
    pin: Pin | None = None  # one of the ten elements that is held (valley.py)


@dataclass(frozen=True)
class Point:
    """A value of every unknown."""

    theta: Array
    starts: tuple[State, ...]  # one a run
    rest_guesses: tuple[State, ...]  # one a static recording
    latents: tuple[Array | None, ...] = ()  # (N, 6) a run: see linearise_run; empty: none


class CannotBeFollowed(FloatingPointError):
    """The model can follow no recording of a problem, or not all of them at once, from a first guess."""

    def __init__(self, problem: Problem, theta: Array, names: tuple[str, ...]) -> None:
        super().__init__("the forward model cannot be evaluated at the first guess")
        self.problem, self.theta, self.names = problem, theta, names


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

    @property
    def is_finite(self) -> bool:
        """Whether cost, information and gradient are numbers."""
        parts = (self.cost, self.information, self.gradient)
        return all(bool(np.all(np.isfinite(part))) for part in parts)


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
    if problem.pin is not None:
        row, miss = pinned(problem, problem.pin, theta)
        cost += 0.5 * miss**2
        information[:INERTIAL, :INERTIAL] += np.outer(row, row)
        gradient[:INERTIAL] += row * miss
    return cost, information, gradient


def pinned(problem: Problem, pin: Pin, theta: Array) -> tuple[Array, float]:
    """(10,) derivatives of a pinned element by the body's vector, and what it misses, both in stds."""
    parameters = problem.bench.parameters
    value = float(parameters.elements(theta)[pin.element])
    return parameters.elements_jacobian(theta)[pin.element] / pin.std, (pin.value - value) / pin.std


def evaluate(problem: Problem, point: Point, *, residuals_only: bool = False) -> Evaluation | None:
    """Linearise everything at ``point``; None where a run or a rest pose cannot be computed.

    residuals_only: residuals and cost hold, what else is derived from the runs' derivatives does not; it
    takes a quarter of the time.
    """
    if not (np.all(np.isfinite(point.theta)) and all(start.is_finite for start in point.starts)):
        # A step so long that no number holds it, or its start cannot be put back onto the cables
        return None
    bench = problem.bench
    latents = point.latents or (None,) * len(problem.runs)

    def one(item: tuple[Run, State, Array | None]) -> Linearised | None:
        run, start, latent = item
        return linearise_run(
            bench,
            run,
            point.theta,
            start,
            start_only=residuals_only,
            extra_noise=problem.extra_noise,
            latent=latent,
            discrepancy=problem.discrepancy,
        )

    runs = side_by_side(one, zip(problem.runs, point.starts, latents, strict=True))
    if any(r is None for r in runs):
        return None
    rests = []
    for evidence, guess in zip(problem.rests, point.rest_guesses, strict=True):
        rest = linearise_rest(bench, evidence, point.theta, guess, problem.discrepancy)
        if rest is None:
            parameters = bench.at(evidence.recording.name, 0.0).parameters
            model = with_dummy(model_at(parameters, point.theta), evidence.dummy)
            settled = settle(model, guess, FALLS)
            rest = linearise_rest(bench, evidence, point.theta, settled, problem.discrepancy)
        if rest is None:
            return None
        rests.append(rest)
    found = _assemble(problem, point, tuple(r for r in runs if r is not None), tuple(rests))
    # Derivatives of a motion that parts from its neighbours may grow beyond every number
    return found if found.is_finite else None


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
    for run, start, of in zip(runs, point.starts, problem.runs, strict=True):
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
        if problem.bench.unseen:
            basis = start_basis(model_at(problem.bench.of(of).parameters, point.theta), start)
            belief = swing_belief(problem.bench.rig, start, basis, problem.bench.calm)
            cost += belief[0]
            information[np.ix_(columns[p:], columns[p:])] += belief[1]
            gradient[columns[p:]] += belief[2]
        place += starts
    for rest in rests:
        information[:p, :p] += rest.jacobian.T @ rest.jacobian
        gradient[:p] += rest.jacobian.T @ rest.residual
        cost += rest.cost
    return Evaluation(point, runs, rests, cost, information, np.diag(prior).copy(), gradient)


def moved_by(problem: Problem, evaluation: Evaluation, change: Array) -> Point:
    """Where a step of every unknown leads."""
    p = problem.bench.parameters.size
    theta = problem.bench.parameters.moved(evaluation.point.theta, change[:p])
    starts, place = [], p
    for run, state in zip(problem.runs, evaluation.point.starts, strict=True):
        parameters = problem.bench.of(run).parameters
        old, new = model_at(parameters, evaluation.point.theta), model_at(parameters, theta)
        basis = start_basis(old, state)
        own = change[place : place + basis.shape[1]]
        starts.append(on_cables(new, state.moved(basis @ own)))
        place += basis.shape[1]
    guesses = tuple(rest.rest.state for rest in evaluation.rests)
    return Point(theta, tuple(starts), guesses, evaluation.point.latents)


def _bounded_step(problem: Problem, current: Evaluation, damping: float, bend: Array | float = 0.0) -> Array:
    """Damped Gauss-Newton step that keeps the free parameters within their bound.

    The body moves by no more than the problem's stride; everything else then takes the step
    that is best with the body where it got to. bend: what curvature adds to the gradient.
    """
    information = current.information + damping * np.diag(np.diag(current.information))
    change = np.zeros(information.shape[0])
    fixed = np.zeros(information.shape[0], dtype=bool)
    current = replace(current, gradient=current.gradient + bend)
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
    """Best step of all that is not ``fixed``, which makes the ``change`` given, with every bound kept.

    Where Newton's step passes a bound, unbounded unknowns are eliminated (Schur complement), which leaves
    a convex quadratic problem in a box.
    """
    p = problem.bench.parameters.size
    open_, held = np.flatnonzero(~fixed), np.flatnonzero(fixed)
    inside = definite(information[np.ix_(open_, open_)])
    right = current.gradient[open_] - information[np.ix_(open_, held)] @ change[held]
    change = change.copy()
    change[open_] = np.linalg.solve(inside, right)
    limit = np.full(change.size, np.inf)
    limit[INERTIAL:p] = [limit_of(problem, q) for q in problem.bench.parameters.free]
    here = np.zeros(change.size)
    here[:p] = current.point.theta
    if np.all(np.abs(here + change)[open_] <= limit[open_] + 1e-9):
        return change
    boxed = np.isfinite(limit[open_])
    inner, outer = np.flatnonzero(boxed), np.flatnonzero(~boxed)
    across = inside[np.ix_(outer, inner)]
    solved = np.linalg.solve(
        inside[np.ix_(outer, outer)], np.concatenate([across, right[outer, None]], axis=1)
    )
    box, middle = limit[open_][inner], here[open_][inner]
    step = in_box(
        definite(inside[np.ix_(inner, inner)] - across.T @ solved[:, :-1]),
        right[inner] - across.T @ solved[:, -1],
        -box - middle,
        box - middle,
    )
    change[open_[inner]] = step
    change[open_[outer]] = solved[:, -1] - solved[:, :-1] @ step
    return change


#: Share of what a step promises that it keeps at least once it is pulled back: where it does not it is too
#: long for a second order as well, and a damped one leads less astray.
KEPT = 0.5


def _pulled_back(
    problem: Problem, current: Evaluation, damping: float, change: Array, there: Evaluation
) -> Array:
    """The step ``change``, which led to ``there``, with what is of second order in it taken back.

    Where measurements hold a combination of unknowns far tighter than each one of them, as four taut cables'
    tensions hold a rig's geometry, a long step leaves the narrow curved valley that they make and costs a
    thousand times what it wins. With how far all residuals ``there`` are from what first order told of them,
    and the derivatives of where the step began, it is solved for again: a "second-order correction" (Nocedal
    and Wright, "Numerical Optimization", 2006, section 15.6). It takes residuals alone, and no differences.
    """
    told = current.gradient - current.information @ change
    runs = zip(there.runs, current.runs, strict=True)
    rests = zip(there.rests, current.rests, strict=True)
    found = _assemble(
        problem,
        there.point,
        tuple(replace(run, jacobian=here.jacobian) for run, here in runs),
        tuple(replace(rest, jacobian=here.jacobian) for rest, here in rests),
    )
    return _bounded_step(problem, current, damping, found.gradient - told)


#: No positive number leaves so many std of its logarithm's prior.
WIDEST = 3.0


def limit_of(problem: Problem, parameter: Parameter) -> float:
    """Std of its prior that a free parameter stays within."""
    if parameter.ratio:
        return WIDEST
    return problem.bound if parameter.bounded else np.inf


#: Mean square of the whitened residuals above which a fit explains nothing.
HOPELESS = 100.0
#: Share of what noise does not account for below which a step's gain is not worth taking: a model
#: that lacks something has no optimum worth polishing.
POLISH = 3e-3
#: Factors on the damping after a step that paid and after one that did not.
EASED, BRAKED = 0.2, 5.0
#: Evaluations that a fit may take for each of its steps on average, and what one without derivatives costs.
PATIENCE, QUICK = 3.0, 0.3
#: Damped steps of so little gain, one after the other, that end a fit as well.
IDLE = 2
#: Part of a cost that is rounding.
ROUNDING = 1e-9
#: Gain (nats) of a step that gets nowhere, and how many of them in a row end a fit.
CREEP, CREPT = 0.01, 4


#: Gain (nats) that a full step promises at most where a fit is at its end but for the residuals' spreads, and
#: how often such a step may lose what it promises to win: it leads to where no residual asks for another one.
#: The spreads' own slope, which is not in the Jacobian, lets the cost rise there by parts of a nat.
AT_ROOT, LEAPS = 1.0, 3
#: Gain (nats) that a full step may still promise where no step keeps it: the optimum is then within half a
#: standard deviation.
CLOSE = 0.125
#: ... and out of steps, along a valley so flat that a step wins next to nothing: within one.
NEARLY = 0.5


def as_good_as_settled(problem: Problem, current: Evaluation, close: float = CLOSE) -> bool:
    """Whether a fit that gets nowhere any more is where it should be. close: nats.

    The residuals' spreads depend on the parameters as well, and that slope is not in the Jacobian: at
    the best point it and the residuals' own balance, and a full step promises a little for ever.
    """
    return still_promised(problem, current) < close and not on_plateau(current)


def still_promised(problem: Problem, current: Evaluation) -> float:
    """Gain (nats) that a full step would bring to second order."""
    return promised_by(current, left_to_go(problem, current))


def left_to_go(problem: Problem, current: Evaluation) -> Array:
    """The full step, of every unknown, from where a fit ended."""
    return _bounded_step(problem, current, 0.0)


def promised_by(current: Evaluation, change: Array) -> float:
    """Gain (nats) of a step to second order."""
    return float(change @ current.gradient - 0.5 * change @ current.information @ change)


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


@dataclass
class Damping:
    """How much steps are damped: in parts of what a unit step in each unknown's own scale costs.

    A fit that goes on where another one of much the same problem ended goes on with its damping: to find it
    again takes half a dozen steps that do not pay.
    """

    value: float = 1e-6


def solve(
    problem: Problem,
    point: Point,
    *,
    damped: Damping | None = None,
    iterations: int = 30,
    tolerance: float = 1e-3,
    polish: float = 0.0,
    patience: float = PATIENCE,
    notify: Callable[[int, float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> tuple[Evaluation, bool]:
    """Minimise from ``point``: (last evaluation, whether it converged).

    Converged where the predicted gain of a full step falls below ``tolerance`` (nats): the
    estimate is then within sqrt(2 tolerance) of its own standard deviation from the optimum. Where
    a step won less than ``polish`` of what stays unexplained, the fit ends there as well: a
    hypothesis that leaves much is not worth following down every valley. Out of steps it has converged
    where a full step promises less than NEARLY. A step that does not pay is pulled
    back into its valley before it is damped, and the next ones are tried without derivatives first. Steps
    that win next to nothing, one after the other, end it too, unconverged: along bounds a valley may be
    followed for ever.
    A plateau, where nothing fits and nothing answers any more, does not count. Where ``stop`` says so the fit
    ends after the step that it tries, unconverged. patience: evaluations that a step may take on average.
    damped: what it begins with, and what it came to after.
    """
    damped = damped or Damping()
    current = evaluate(problem, point)
    if current is None:
        recordings = [run.recording.name for run in problem.runs]
        recordings += [rest.recording.name for rest in problem.rests]
        raise CannotBeFollowed(problem, point.theta, tuple(dict.fromkeys(recordings)))
    damping, failed, creeping, idle, spent, against = damped.value, 0.0, 0, 0, 0.0, 0
    for iteration in range(iterations):
        turned_back = False
        while True:
            damped.value = damping
            if spent > patience * iterations:
                return current, as_good_as_settled(problem, current, NEARLY)
            # About as little damping failed last
            wary = damping <= 1.01 * BRAKED * failed
            change = _bounded_step(problem, current, damping)
            gain = promised_by(current, change)
            # Along a flat valley the least damping takes all promise away: an undamped step tells the end
            if gain < tolerance and damping <= 1e-3 and still_promised(problem, current) < tolerance:
                return current, not on_plateau(current)
            if damping > 1e-3 and gain < polish * excess(current):
                # Held back so much, no step can win what would be worth it
                return current, as_good_as_settled(problem, current)
            moved, allowed = moved_by(problem, current, change), current.cost + ROUNDING * abs(current.cost)
            if damping <= 1e-3 and gain < AT_ROOT and against < LEAPS:
                allowed += gain
            trial = evaluate(problem, moved, residuals_only=True) if wary else None
            spent += QUICK if wary else 0.0
            if not wary or (trial is not None and trial.cost < allowed):
                trial = _in_full(problem, moved, trial)
                spent += 1.0
            if trial is not None and trial.cost >= allowed:
                change = _pulled_back(problem, current, damping, change, trial)
                moved = moved_by(problem, current, change)
                trial = evaluate(problem, moved, residuals_only=True)
                spent += QUICK
                if trial is not None and current.cost - trial.cost > KEPT * gain:
                    trial = _in_full(problem, moved, trial)
                    spent += 1.0
                else:
                    trial = None
            if trial is not None and trial.cost < allowed:
                if damping <= failed:
                    failed = 0.0
                damping = damping if turned_back else max(damping * EASED, 1e-9)
                won, current = current.cost - trial.cost, trial
                against += won < 0.0
                creeping = creeping + 1 if won < CREEP else 0
                if creeping == CREPT:
                    return current, as_good_as_settled(problem, current, NEARLY)
                idle = idle + 1 if max(won, tolerance) < polish * excess(current) else 0
                if idle and (damping <= 1e-3 or idle == IDLE):
                    return current, damping <= 1e-3 and not on_plateau(current)
                break
            if gain < CLOSE and damping <= 1e-3 and still_promised(problem, current) < CLOSE:
                return current, not on_plateau(current)
            failed, turned_back = max(failed, damping), True
            damping = max(damping, 1e-6) * BRAKED
            if damping > 1e6:
                return current, as_good_as_settled(problem, current)
            if stop is not None and stop():
                return current, False
        if notify is not None:
            notify(iteration, current.cost)
        if stop is not None and stop():
            break
    return current, as_good_as_settled(problem, current, NEARLY)


def _in_full(problem: Problem, point: Point, quick: Evaluation | None) -> Evaluation | None:
    """Everything at ``point``, of which ``quick`` holds the residuals; all of them there is without runs."""
    return evaluate(problem, point) if problem.runs or quick is None else quick


def shortened(problem: Problem, end: float) -> Problem:
    """The same problem on the first ``end`` seconds of every run."""
    return replace(problem, runs=tuple(run.until(end) for run in problem.runs))
