"""One hypothesis in the model: started where screening promised, fitted, and what its fit says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.growing import (
    NEAR_SQUARE,
    held_over,
    misfit,
    settled_starts,
)
from rig_identification.estimate.identify import ORDINARY
from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import POLISH, Evaluation, Point, Problem, evaluate, solve
from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.opened import Promise, carried, extended
from rig_identification.model.definite import definite

Array = NDArray[np.float64]
#: Whether a fit is to end after the step that it is at.
Stop = Callable[[], bool]

#: Std by which one of several numbers may lie on the wrong side of zero by chance.
ABSURD = 3.0
#: Half-width of a normal distribution's 95 % interval, in std.
NORMAL_95 = 1.96
#: Steps of a first, short fit (more where the model itself changes) and of one to the end.
FIRST_STEPS = 4
CHANGED_STEPS = 7
#: Steps in which a fit that starts at a promise has to be back where it fits better than without.
RETURNING_STEPS = 5
LAST_STEPS = 20
#: Share of what near the noise was promised that steps from where a fit stands have to keep.
KEPT = 0.5
#: Share of their prior's std within which such ratios are held at first.
HELD = 0.05
#: Ends (s) of the first horizons over which a changed model is fitted.
HORIZONS = (0.4, 1.2)
#: Mean square of the residuals above which so much is left that what leaves nothing of it is no chance, and
#: the share of it that is still left over the first horizons by what rings or swings and is not there.
VERY_FAR, LARGER = 5.0, 0.5
#: Mean square of all pieces' residuals with what was fitted to a few of them, below which they agree to it.
AGREED = 1.05
#: Std of its prior that a fit starts away from at most.
FARTHEST = 3.0


@dataclass(frozen=True)
class Trial:
    """A hypothesis fitted in full."""

    candidate: Candidate
    problem: Problem
    evaluation: Evaluation
    evidence: float  # log marginal likelihood less a constant
    settled: bool = False  # fitted to its end

    @property
    def values(self) -> dict[str, float]:
        """What the fit makes of the hypothesis' parameters, in their own units, by name."""
        named = self.problem.bench.parameters.named(self.evaluation.point.theta)
        return {q.name: named[q.name] for q in self.candidate.parameters}


def mass_of(problem: Problem, evaluation: Evaluation) -> float:
    """Mass of the body as fitted, kg."""
    return float(problem.bench.parameters.elements(evaluation.point.theta)[0])


def log_evidence(evaluation: Evaluation) -> float:
    """Laplace: log posterior at its peak, less half the log of how much sharper it is than the prior.

    Start states have flat priors and count alike in every hypothesis; their share cancels
    but for its correlation, which the determinant keeps.
    """
    _, log_det = np.linalg.slogdet(definite(evaluation.information))
    return -evaluation.cost - 0.5 * float(log_det)


def attempt(
    problem: Problem,
    evaluation: Evaluation,
    promise: Promise,
    budget: Budget = UNLIMITED,
) -> Trial | None:
    """A first, short fit of one hypothesis from what screening promised; None where it cannot start or be.

    It ends where the ``budget`` is spent.
    """
    stop = budget.spent
    candidate = promise.candidate
    wide = extended(problem, (candidate,))
    begun = carried(wide, problem, evaluation.point)
    point = promised(wide, begun, candidate, promise.values, evaluation)
    try:
        if candidate.build is not None:
            far = misfit(evaluation) > NEAR_SQUARE
            point, left = _grown(wide, candidate, point, far, stop)
            if left > VERY_FAR and left > LARGER * _over_first(problem, evaluation):
                # What the first second shows so much of, and the changed model hardly any, is something else
                return None
            fitted, settled = _first_steps(wide, point, CHANGED_STEPS, stop)
        else:
            fitted, settled = _from_promise(
                wide, point, _placed(begun, point, wide, candidate), promise.gain, stop
            )
    except FloatingPointError:
        return None
    trial = Trial(candidate, wide, fitted, log_evidence(fitted), settled and misfit(fitted) < NEAR_SQUARE)
    return None if _beyond_its_amount(trial) else trial


def _placed(begun: Point, promised: Point, problem: Problem, candidate: Candidate) -> Point:
    """Where a fit stands, with what has no amount yet at its promised place: there it tells its amount."""
    theta = begun.theta.copy()
    for p in candidate.parameters:
        if ".point." in p.name:
            i = problem.bench.parameters.index_of(p.name)
            theta[i] = promised.theta[i]
    return replace(begun, theta=theta)


def _first_steps(problem: Problem, point: Point, steps: int, stop: Stop) -> tuple[Evaluation, bool]:
    return solve(problem, point, iterations=steps, tolerance=0.5, polish=POLISH, stop=stop)


def _from_promise(
    problem: Problem, promised: Point, begun: Point, gain: float, stop: Stop
) -> tuple[Evaluation, bool]:
    """First steps of a fit that does not change the model, from where it stands (``begun``) or a promise.

    A promise holds where all that is fitted moves with it, to first order. By itself, over half a minute, it
    throws everything out by more than the whole effect; yet Gauss-Newton steps from there are soon back on
    the valley's floor, far along it, where descent from where the fit stands follows every bend. Where they
    are not, that is what is left to do. Near the noise hardly anything bends: steps from where the fit stands
    come to what was promised (``gain``, nats), and only where they do not the promise is tried.
    """
    there, here = (evaluate(problem, p, residuals_only=True) for p in (promised, begun))
    if there is None:
        return _first_steps(problem, begun, FIRST_STEPS, stop)
    if here is None or there.cost <= here.cost:
        return _first_steps(problem, promised, FIRST_STEPS, stop)
    straight = None
    if misfit(here) < NEAR_SQUARE:
        straight = _first_steps(problem, begun, FIRST_STEPS, stop)
        if here.cost - straight[0].cost > KEPT * gain:
            return straight
    fitted, settled = _first_steps(problem, promised, RETURNING_STEPS, stop)
    if fitted.cost > min(here.cost, np.inf if straight is None else straight[0].cost):
        return straight or _first_steps(problem, begun, FIRST_STEPS, stop)
    return (fitted, settled) if settled else _first_steps(problem, fitted.point, FIRST_STEPS, stop)


def promised(
    problem: Problem, point: Point, candidate: Candidate, values: dict[str, float], evaluation: Evaluation
) -> Point:
    """The point with ``values`` of a hypothesis that is in the model, in their own units."""
    theta = point.theta.copy()
    for k, p in enumerate(candidate.parameters):
        if p.name not in values:
            continue
        i = problem.bench.parameters.index_of(p.name)
        free = problem.bench.parameters.free[i - INERTIAL]
        theta[i] = float(np.clip(free.position(values[p.name]), -FARTHEST, FARTHEST))
        if k < candidate.positive:
            theta[i] = max(theta[i], 0.0)
    point = replace(point, theta=theta)
    return point if candidate.settle is None else candidate.settle(problem, point, evaluation)


def _grown(
    problem: Problem, candidate: Candidate, point: Point, far: bool, stop: Stop
) -> tuple[Point, float]:
    """The point from where a fit of a changed model to all of its runs starts.

    A changed model throws the start states out first, and its amount comes before its other ratios. Where
    much is left (far) it is fitted over the first instants before: what stretches or yields rings at tens of
    hertz, over some seconds a stiffness a percent off is half a turn out of step, and everything else bends
    to that (growing.py). Near the noise first order is about right, and short horizons tell nothing.

    Also returns the mean square that is left over the last of these horizons; 0 near the noise.
    """
    if not far:
        return _with_amount(problem, candidate, replace(point, starts=settled_starts(problem, point))), 0.0
    left = 0.0
    for end in HORIZONS:
        part = held_over(problem, end, point.theta[:INERTIAL].copy())
        point = replace(point, starts=settled_starts(part, point))
        if end == HORIZONS[0]:
            point = _with_amount(part, candidate, point)
        fitted, _ = solve(part, point, iterations=CHANGED_STEPS, tolerance=0.5, polish=POLISH, stop=stop)
        point, left = fitted.point, misfit(fitted)
    return replace(point, starts=settled_starts(problem, point)), left


def _over_first(problem: Problem, evaluation: Evaluation) -> float:
    """Mean square that a fit leaves over the last of the first horizons, each start at its best."""
    point = evaluation.point
    part = held_over(problem, HORIZONS[-1], point.theta[:INERTIAL].copy())
    there = evaluate(part, replace(point, starts=settled_starts(part, point)), residuals_only=True)
    return np.inf if there is None else misfit(there)


def _with_amount(problem: Problem, candidate: Candidate, point: Point) -> Point:
    """The point after a few steps in which an effect's amount moves and its other ratios are held.

    How much there is of an effect shows at any frequency or damping of its own; these make sense only of
    about the right amount, and run far away before.
    """
    parameters = problem.bench.parameters
    own = {p.name for p in candidate.parameters[1:]}
    held = tuple(
        replace(p, prior_std=HELD * p.prior_std) for p in parameters.free if p.ratio and p.name in own
    )
    narrow = replace(problem, bench=replace(problem.bench, parameters=parameters.having(held)))
    fitted, _ = solve(
        narrow, carried(narrow, problem, point), iterations=FIRST_STEPS, tolerance=0.5, polish=POLISH
    )
    return carried(problem, narrow, fitted.point)


def finished(trial: Trial, budget: Budget = UNLIMITED) -> Trial | None:
    """The trial fitted to its end, as its closest description has it; None where its sign makes no sense.

    A closer description is fitted from where the first steps led: what is not one fits by running away from
    there. Where the ``budget`` is spent it stays where it is.
    """
    stop = budget.spent
    if not trial.settled and not stop():
        closest = _closest(trial, stop)
        if closest is not trial:
            return replace(closest, candidate=replace(closest.candidate, closer=None))
    if not trial.settled and not stop():
        fitted, _ = solve(
            trial.problem,
            trial.evaluation.point,
            iterations=LAST_STEPS,
            tolerance=0.05,
            polish=POLISH,
            stop=stop,
        )
        trial = replace(trial, evaluation=fitted, evidence=log_evidence(fitted), settled=True)
    if not _sensible(trial):
        return None
    if stop():
        return trial
    closest = _closest(trial, stop)
    return replace(closest, candidate=replace(closest.candidate, closer=None))


def fitted_to_its_end(
    problem: Problem, evaluation: Evaluation, promise: Promise, budget: Budget = UNLIMITED
) -> Trial | None:
    """A promise's first steps, and the trial fitted to its end; None where either leads nowhere."""
    begun = attempt(problem, evaluation, promise, budget)
    return None if begun is None else finished(begun, budget)


def _closest(trial: Trial, stop: Stop) -> Trial:
    """The likeliest closer description of a trial's effect; the trial where none is likelier."""
    if trial.candidate.closer is None:
        return trial
    closer = (
        _described(trial, candidate, values, stop)
        for candidate, values in trial.candidate.closer(trial.problem, trial.evaluation)
    )
    return max((trial, *(t for t in closer if t is not None and _sensible(t))), key=lambda t: t.evidence)


def _sensible(trial: Trial) -> bool:
    """Whether what cannot be negative is not, as a trial ends, and what is at a place can be there."""
    if not possible(trial) or _beyond_its_amount(trial):
        return False
    return trial.candidate.positive != 1 or all(z >= 0.0 for z in signs(trial))


def _beyond_its_amount(trial: Trial) -> bool:
    """Whether numbers that come of an amount are larger than it can make them, and stand for something else.

    Such a trial is over before what is likelier with it keeps others from being fitted to their end.
    """
    most = trial.candidate.per_amount
    if most == 0.0:
        return False
    values = trial.problem.bench.parameters.named(trial.evaluation.point.theta)
    amount, *others = (values[q.name] for q in trial.candidate.parameters)
    return bool(np.linalg.norm(others) > most * amount)


def possible(trial: Trial) -> bool:
    """Whether nothing that cannot be negative clearly is, and what is at a place of the body can be there.

    In whole runs, which may lead a trial elsewhere than where it ended, an amount that may as well be none is
    dropped (pruned) and no reason to doubt what is beside it.
    """
    return all(z >= -ABSURD for z in signs(trial)) and in_reach(trial)


def in_reach(trial: Trial) -> bool:
    """Whether no coordinate of an effect's place lies clear of all that a body in this rig may fill.

    A hose eight metres beside the car that it pulls at stands for something else.
    """
    names = {p.name for p in trial.candidate.parameters if ".point." in p.name or ".position." in p.name}
    if not names:
        return True
    size = float(np.max(extent(trial.problem.bench.rig)))
    found = estimates(trial.problem, trial.evaluation)
    coordinates = [p for p in trial.problem.bench.parameters.free if p.name in names]
    return all(
        abs(found.values[p.name] - p.nominal) - ABSURD * found.std(p.name) <= size for p in coordinates
    )


def _described(trial: Trial, candidate: Candidate, values: dict[str, float], stop: Stop) -> Trial | None:
    """The trial with another description of its effect, started at ``values`` and fitted to its end."""
    problem = trial.problem
    instead = {q.name for q in trial.candidate.parameters}
    parameters = problem.bench.parameters
    parameters = replace(parameters, free=tuple(q for q in parameters.free if q.name not in instead))
    wide = extended(replace(problem, bench=replace(problem.bench, parameters=parameters)), (candidate,))
    point = promised(
        wide, carried(wide, problem, trial.evaluation.point), candidate, values, trial.evaluation
    )
    try:
        fitted, _ = solve(wide, point, iterations=LAST_STEPS, tolerance=0.05, polish=POLISH, stop=stop)
    except FloatingPointError:
        return None
    return Trial(candidate, wide, fitted, log_evidence(fitted), True)


def signs(trial: Trial) -> list[float]:
    """What cannot be negative, in units of its own std."""
    positive = trial.candidate.parameters[: trial.candidate.positive]
    if not positive:
        return []
    seen = in_stds(trial)
    return [seen[p.name] for p in positive]


def may_be_none(trial: Trial) -> bool:
    """Whether the 95 % interval of every amount includes none; all numbers count where none is an amount.

    A number that is a ratio is never none.
    """
    free = {p.name: p for p in trial.problem.bench.parameters.free}
    amounts, seen = trial.candidate.amounts, in_stds(trial)
    if any(free[p.name].ratio for p in amounts):
        return False
    return all(abs(seen[p.name]) < NORMAL_95 for p in amounts)


def in_stds(trial: Trial) -> dict[str, float]:
    """Free parameters' positions in units of their own std, by name."""
    theta, free = trial.evaluation.point.theta, trial.problem.bench.parameters.free
    std = np.sqrt(np.diag(invert_information(trial.evaluation.information)))[: theta.size]
    return {p.name: float(z) for p, z in zip(free, (theta / std)[INERTIAL:], strict=True)}


def ordinary_errors(problem: Problem) -> dict[str, float]:
    """Tolerance of every number that the lab doubts itself, by name, in its own unit."""
    return {p.name: p.prior_std for p in problem.bench.parameters.free if p.bounded}


def beyond_doubt(trial: Trial, ordinary: dict[str, float], limit: float) -> bool:
    """Whether a freed doubt really lies beyond what is ordinary: an addition does that no device has."""
    parameters = trial.problem.bench.parameters
    values = parameters.named(trial.evaluation.point.theta)
    known = trial.candidate.ordinary or ordinary
    freed = [p for p in trial.candidate.parameters if p.name in known]
    if len(freed) < len(trial.candidate.parameters) and not trial.candidate.ordinary:
        return True
    return any(abs(values[p.name] - p.nominal) > limit * known[p.name] for p in freed)


def is_ordinary(trial: Trial) -> bool:
    """Whether it is an error that the ideal model does not know, and no larger than every such rig has it.

    Devices' clocks differ by tolerances, and by as much some follow late. That is no finding, and belongs in
    the model all the same: without it no residual of a sharp sensor is noise.
    """
    return ordinary_amount(trial.candidate, trial.values)


def ordinary_amount(candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Whether ``values`` (by name) of an error that the ideal model does not know are what every rig has."""
    amounts = [p for p in candidate.parameters if p.name in candidate.ordinary]
    return bool(amounts) and all(
        abs(values.get(p.name, np.inf) - p.nominal) <= ORDINARY * candidate.ordinary[p.name] for p in amounts
    )


def strength(trial: Trial, ordinary: dict[str, float] | None = None) -> float:
    """Gain (nats) of the trial's parameters over none of them, to second order (Wald).

    ordinary: by name, how far off (own units) a model without them may have them; over none beyond that then.
    """
    within = ordinary or {}
    parameters = trial.problem.bench.parameters
    free = {p.name: p for p in parameters.free}
    own = [free[p.name] for p in trial.candidate.parameters if not free[p.name].ratio]
    if not own:
        return float(np.inf)
    index = [parameters.index_of(p.name) for p in own]
    value = trial.evaluation.point.theta[index]
    allowed = np.array([within.get(p.name, 0.0) / p.prior_std for p in own])
    value = np.sign(value) * np.maximum(np.abs(value) - allowed, 0.0)
    covariance = invert_information(trial.evaluation.information)[np.ix_(index, index)]
    return 0.5 * float(value @ np.linalg.solve(covariance, value))
