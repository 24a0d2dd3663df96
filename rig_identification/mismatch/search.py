"""From a session that the ideal model does not explain to the effects that do.

Screening (screen.py) ranks every hypothesis; the best few are fitted in full, in short
pieces first, where no model is far off; the most likely one stays (Laplace's approximation of the
marginal likelihood charges each free parameter for what it could have explained). Then the
whole runs are fitted with it, and if something is left the search goes on from there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from rig_identification.estimate.growing import NEAR_SQUARE, held_over, misfit, settled_starts
from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.parameters import AXES, INERTIAL
from rig_identification.estimate.solve import (
    POLISH,
    Evaluation,
    Point,
    Problem,
    evaluate,
    excess,
    shortened,
    solve,
)
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.late import told_apart
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.locate import devices_of, find_liar
from rig_identification.mismatch.riders import SWINGS, Swing, rider_candidate
from rig_identification.mismatch.rig_errors import rig_errors
from rig_identification.mismatch.screen import Promise, carried, extended, screen
from rig_identification.mismatch.sensor_errors import sensor_errors
from rig_identification.mismatch.supports import (
    cable_elasticity,
    ceiling_candidate,
    gives_way,
    largest_compliance,
    usual_stiffness,
)

Array = NDArray[np.float64]
Notify = Callable[[str], None]

#: Chance that a session without any effect shows one, over all hypotheses together.
FALSE_ALARM = 0.005
#: Hypotheses fitted in full after each screening, and effects looked for at most.
FITTED = 4
#: Of these, at most so many of one effect: its other places are its rivals anyway.
ALIKE = 3
#: Share of what is left that a promise has to take for its fit to come before any other doubt.
DIRECT = 0.8
MOST_EFFECTS = 2
#: A promise this much (nats) behind the best is not worth a fit, in parts of the best; nor is what gives way
#: where trying its amounts takes away no larger part of what is left.
WORTH = 0.05
#: Pieces that hypotheses are tried on.
TRIED = 4
#: Log evidence that an effect has to gain.
MEANT = 3.0
TRIED_FAR = 2
#: Std by which one of several numbers may lie on the wrong side of zero by chance.
ABSURD = 3.0
VERY_FAR = 5.0
#: Mean square of whitened residuals below which nothing much is left, and how many times as much as the best
#: a hypothesis may have left after its first steps to be its rival even so.
AT_NOISE = 1.05
RIVAL = 10.0
#: Share of what was left up to which a hypothesis, after its first steps, is fitted to its end at once.
ALMOST = 0.05
#: Share of what is left that counts as the larger part of it.
CHIEF = 0.5
#: Standard deviations of a sum of squares beyond which something is left of the residuals as a whole.
SEEN = 4.0
#: Near the noise: log evidence by which a hypothesis is beaten for good, and the share of what another one
#: won that its promise must come to.
BEATEN = 30.0
CLOSE = 0.7
#: Steps of a first, short fit (more where the model itself changes) and of one to the end, and how many
#: hypotheses get that far.
FIRST_STEPS = 4
CHANGED_STEPS = 7
LAST_STEPS = 20
#: Share of their prior's std within which such ratios are held at first.
HELD = 0.05
FINISHED = 3
#: Ends (s) of the first horizons over which a changed model is fitted.
HORIZONS = (0.4, 1.2)
#: Std of its prior that a fit starts away from at most, and parts of the largest compliance of a ceiling that
#: are tried where the probe says nothing.
FARTHEST = 3.0
SINKS = (0.03, 0.7)
#: Multiples of the usual stiffness of cables that are tried first: thin wire to thick rope.
STRETCHES = (0.1, 10.0)
#: Factor between two amounts, and where little is left.
SPACED, FINELY = 3.2, 1.4


@dataclass(frozen=True)
class Trial:
    """A hypothesis fitted in full."""

    candidate: Candidate
    problem: Problem
    evaluation: Evaluation
    evidence: float  # log marginal likelihood less a constant
    settled: bool = False  # fitted to its end


def catalogue(problem: Problem) -> list[Candidate]:
    """Every hypothesis that this session's rig and channels admit."""
    rig, parameters = problem.bench.rig, problem.bench.parameters
    mass = float(
        parameters.elements(np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)]))[0]
    )
    return [
        *sensor_errors(rig, parameters, [d for d in devices_of(problem) if d != "exciter"]),
        *rig_errors(rig, parameters),
        *left_out_physics(rig, parameters, mass),
    ]


def mass_of(problem: Problem, evaluation: Evaluation) -> float:
    """Mass of the body as fitted, kg."""
    return float(problem.bench.parameters.elements(evaluation.point.theta)[0])


def needed_gain(candidate: Candidate, count: int) -> float:
    """Gain (nats) that noise exceeds with chance FALSE_ALARM over ``count`` trials (Wilks, Bonferroni)."""
    return 0.5 * float(chi2.isf(FALSE_ALARM / count, len(candidate.parameters)))


def log_evidence(evaluation: Evaluation) -> float:
    """Laplace: log posterior at its peak, less half the log of how much sharper it is than the prior.

    Start states have flat priors and count alike in every hypothesis; their share cancels
    but for its correlation, which the determinant keeps.
    """
    sign, log_det = np.linalg.slogdet(evaluation.information)
    return -evaluation.cost - 0.5 * float(log_det) if sign > 0 else -np.inf


def worst_pieces(problem: Problem, evaluation: Evaluation) -> tuple[Problem, Evaluation]:
    """The problem on the pieces that fit worst: what tells hypotheses apart at a fraction of the cost."""
    tried = TRIED_FAR if misfit(evaluation) > VERY_FAR else TRIED
    if len(problem.runs) <= tried:
        return problem, evaluation
    misfits = [float(np.sum(run.residual**2) - run.residual.size) for run in evaluation.runs]
    chosen = sorted(np.argsort(misfits)[-tried:])
    part = replace(problem, runs=tuple(problem.runs[i] for i in chosen))
    point = replace(
        evaluation.point,
        starts=tuple(evaluation.point.starts[i] for i in chosen),
        latents=tuple(evaluation.point.latents[i] for i in chosen) if evaluation.point.latents else (),
    )
    again = evaluate(part, point)
    return (problem, evaluation) if again is None else (part, again)


def adopted(problem: Problem, evaluation: Evaluation, trial: Trial) -> tuple[Problem, Evaluation]:
    """A trial's effect in the model of all pieces, fitted."""
    wide = extended(problem, (trial.candidate,))
    if len(wide.runs) == len(trial.problem.runs):
        return trial.problem, trial.evaluation
    theta = trial.evaluation.point.theta
    point = carried(wide, problem, evaluation.point)
    if trial.candidate.settle is not None:
        point = trial.candidate.settle(wide, replace(point, theta=theta), evaluation)
    known = {
        (run.recording.name, run.offset): start
        for run, start in zip(trial.problem.runs, trial.evaluation.point.starts, strict=True)
    }
    starts = tuple(
        known.get((run.recording.name, run.offset), start)
        for run, start in zip(wide.runs, point.starts, strict=True)
    )
    fitted, _ = solve(wide, replace(point, theta=theta, starts=starts), iterations=6, tolerance=0.5)
    return wide, fitted


def attempt(problem: Problem, evaluation: Evaluation, promise: Promise) -> Trial | None:
    """A first, short fit of one hypothesis from what screening promised; None where it cannot start."""
    candidate = promise.candidate
    # Blows have no second derivative to follow
    bends = candidate.build is not None and candidate.effect != "loose_mass"
    wide = extended(problem, (candidate,))
    begun = carried(wide, problem, evaluation.point)
    point = _promised(wide, begun, candidate, promise.values, evaluation)
    try:
        if candidate.build is not None:
            point = _grown(wide, candidate, point, misfit(evaluation) > NEAR_SQUARE)
        steps = FIRST_STEPS if candidate.build is None else CHANGED_STEPS
        fitted, settled = solve(wide, point, iterations=steps, tolerance=0.5, polish=POLISH, bends=bends)
    except FloatingPointError:
        return None
    return Trial(candidate, wide, fitted, log_evidence(fitted), settled and misfit(fitted) < NEAR_SQUARE)


def _promised(
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


def _grown(problem: Problem, candidate: Candidate, point: Point, far: bool) -> Point:
    """The point from where a fit of a changed model to all of its runs starts.

    A changed model throws the start states out first, and its amount comes before its other ratios. Where
    much is left (far) it is fitted over the first instants before: what stretches or yields rings at tens of
    hertz, over some seconds a stiffness a percent off is half a turn out of step, and everything else bends
    to that (growing.py). Near the noise first order is about right, and short horizons tell nothing.
    """
    if not far:
        return _with_amount(problem, candidate, replace(point, starts=settled_starts(problem, point)))
    for end in HORIZONS:
        part = held_over(problem, end, point.theta[:INERTIAL].copy())
        point = replace(point, starts=settled_starts(part, point))
        if end == HORIZONS[0]:
            point = _with_amount(part, candidate, point)
        fitted, _ = solve(part, point, iterations=CHANGED_STEPS, tolerance=0.5, polish=POLISH, bends=True)
        point = fitted.point
    return replace(point, starts=settled_starts(problem, point))


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


def finished(trial: Trial) -> Trial | None:
    """The trial fitted to its end; None where its sign makes no sense there."""
    if not trial.settled:
        fitted, _ = solve(
            trial.problem,
            trial.evaluation.point,
            iterations=LAST_STEPS,
            tolerance=0.05,
            polish=POLISH,
            bends=trial.candidate.build is not None,
        )
        trial = replace(trial, evaluation=fitted, evidence=log_evidence(fitted), settled=True)
    if any(z < (0.0 if trial.candidate.positive == 1 else -ABSURD) for z in signs(trial)):
        return None
    return trial


def signs(trial: Trial) -> list[float]:
    """What cannot be negative, in units of its own std."""
    parameters = trial.problem.bench.parameters
    index = [parameters.index_of(p.name) for p in trial.candidate.parameters[: trial.candidate.positive]]
    if not index:
        return []
    std = np.sqrt(np.diag(invert_information(trial.evaluation.information)))
    return [float(trial.evaluation.point.theta[i] / std[i]) for i in index]


def beyond_doubt(trial: Trial, ordinary: dict[str, float], limit: float) -> bool:
    """Whether a freed doubt really lies beyond what is ordinary: an addition always does."""
    parameters = trial.problem.bench.parameters
    values = dict(
        zip((p.name for p in parameters.free), parameters.values(trial.evaluation.point.theta), strict=True)
    )
    freed = [p for p in trial.candidate.parameters if p.name in ordinary]
    if not freed:
        return True
    return any(abs(values[p.name] - p.nominal) > limit * ordinary[p.name] for p in freed)


def strength(trial: Trial) -> float:
    """Gain (nats) of the trial's parameters over none of them, to second order (Wald)."""
    parameters = trial.problem.bench.parameters
    free = {p.name: p for p in parameters.free}
    index = [parameters.index_of(p.name) for p in trial.candidate.parameters if not free[p.name].ratio]
    if not index:
        return float(np.inf)
    value = trial.evaluation.point.theta[index]
    covariance = invert_information(trial.evaluation.information)[np.ix_(index, index)]
    return 0.5 * float(value @ np.linalg.solve(covariance, value))


def _at_noise(trial: Trial) -> bool:
    """Whether a hypothesis leaves residuals of the size of the noise."""
    return misfit(trial.evaluation) < AT_NOISE


def _without_support(tried: list[Trial], before: Evaluation) -> bool:
    """Whether near the noise there is no need to try what gives way.

    There is none where a hypothesis takes away the larger part of what is left. Where the residuals as a
    whole show nothing that is, there is only if something that swings, which is alike, is the best.
    """
    first = max(tried, key=lambda t: t.evidence, default=None)
    left, size = excess(before), sum(run.residual.size for run in before.runs)
    if left < SEEN * np.sqrt(0.5 * size):
        return first is None or first.candidate.build is None
    return first is not None and before.cost - first.evaluation.cost > CHIEF * left


def _almost(trial: Trial, before: Evaluation) -> bool:
    """Whether a hypothesis leaves next to nothing of what was left ``before``, and yet more than noise."""
    return not _at_noise(trial) and excess(trial.evaluation) < ALMOST * excess(before)


@dataclass(frozen=True)
class Trials:
    """Hypotheses fitted in full, most likely first, and the device that contradicts all others."""

    done: list[Trial]
    liar: str | None = None
    beaten: tuple[Trial, ...] = ()  # settled, significant, and yet far less likely than the first


def trials(
    problem: Problem, evaluation: Evaluation, candidates: list[Candidate], limit: float, notify: Notify
) -> Trials:
    """Full fits of the most promising hypotheses to the pieces that fit worst, most likely first.

    All get a few steps; the best few go on to their end, and where one reaches the noise only those
    that had come as close. Where much is left and no hypothesis takes it away that promised to, first order
    is not to be trusted: witnesses are then heard one without the other, and what gives way is
    tried whatever screening says.
    """
    mass = mass_of(problem, evaluation)
    far = misfit(evaluation) > NEAR_SQUARE
    if far:
        problem, evaluation = worst_pieces(problem, evaluation)
    count = len(candidates) + len(SWINGS)
    promises = screen(problem, evaluation, candidates, mass)
    here, seen = (problem, evaluation) if far else worst_pieces(problem, evaluation)
    tried: list[Trial] = []
    if not far or (promises and promises[0].share > DIRECT):
        tried = begun(here, seen, _worthy(promises, count), far, notify)
    device, needed = None, log_evidence(seen) + MEANT
    if far and not any(_at_noise(t) for t in tried):
        liar = None
        if problem.bench.parameters.model.internal == 0:
            # With something that swings in the model such fits take minutes
            notify("without each device in turn")
            liar = find_liar(problem, evaluation)
        if liar is not None:
            # About the fit that does not hear it, what is wrong with it shows as it is
            device = liar.device
            about = evaluate(problem, liar.point) or seen
            worthy = _worthy(screen(problem, about, candidates, mass), count, device)
            tried += begun(here, about, worthy, False, notify)
        if not any(_at_noise(t) for t in tried):
            known = {t.candidate.label for t in tried}
            notify("what gives way")
            worthy = [p for p in far_promises(here, seen, promises, mass) if p.candidate.label not in known]
            known |= {p.candidate.label for p in worthy}
            worthy += [p for p in _worthy(promises, count) if p.candidate.label not in known]
            tried += begun(here, seen, sorted(worthy, key=lambda p: -p.gain), True, notify)
    if not far and not _without_support(tried, seen):
        # Of what rings first order says nothing
        notify("what gives way")
        known = {t.candidate.label for t in tried}
        worthy = [p for p in supports(here, seen, mass) if p.candidate.label not in known]
        tried += begun(here, seen, _worthy(sorted(worthy, key=lambda p: -p.gain), count), False, notify)
    if not tried:
        return Trials([], device)
    ordinary = {p.name: p.prior_std for p in problem.bench.parameters.free if p.bounded}
    tried.sort(key=lambda t: -t.evidence)
    done: list[Trial] = []
    beaten: list[Trial] = []
    for trial in tried:
        last = any(_at_noise(t) for t in done) and _beaten(trial, done, tried[0], far)
        if len(done) == FINISHED or (last and not trial.settled):
            continue
        notify(trial.candidate.label)
        ended = finished(trial)
        if ended is not None and ended.evidence > needed and beyond_doubt(ended, ordinary, limit):
            (beaten if last else done).append(ended)
    return Trials(told_apart(done, MEANT), device, tuple(beaten))


def _worthy(promises: list[Promise], count: int, device: str | None = None) -> list[Promise]:
    """The promises worth a fit, of ``count`` that were made; those of one device where it is known to lie."""
    worthy = [p for p in promises if p.gain > needed_gain(p.candidate, count)]
    if device is not None:
        worthy = [p for p in worthy if p.candidate.where.get("channel") == device] or worthy
    out: list[Promise] = []
    for p in worthy:
        alike = sum(q.candidate.effect == p.candidate.effect for q in out)
        if p.gain > WORTH * worthy[0].gain and alike < ALIKE and len(out) < FITTED:
            out.append(p)
    return out


def _beaten(trial: Trial, done: list[Trial], first: Trial, far: bool) -> bool:
    """Whether a hypothesis is no rival of those that reached the noise, by its first steps."""
    if far:
        return excess(trial.evaluation) > RIVAL * excess(first.evaluation)
    return trial.evidence < max(t.evidence for t in done) - BEATEN


def begun(
    problem: Problem, evaluation: Evaluation, worthy: list[Promise], far: bool, notify: Notify
) -> list[Trial]:
    """First, short fits of promises. far: much is left, and one that reaches the noise is no chance."""
    out: list[Trial] = []
    reached, kept = 0.0, 0.0
    if not far:
        # What changes no model is fitted in a tenth of the time, and may leave nothing for what does
        worthy = sorted(worthy, key=lambda p: (p.candidate.build is not None, -p.gain))
    for promise in worthy:
        if not far and promise.gain < min(CLOSE * kept, kept - BEATEN):
            # Another hypothesis promised much more, near the noise, and kept it
            continue
        if far and promise.candidate.build is not None and promise.gain < CLOSE * reached:
            # Another hypothesis left nothing already, and much more was expected of it
            continue
        notify(promise.candidate.label)
        trial = attempt(problem, evaluation, promise)
        if trial is not None and far and _almost(trial, evaluation):
            # Worth its last steps before any other is tried
            trial = finished(trial) or trial
        if trial is not None:
            out.append(trial)
            kept = max(kept, min(promise.gain, evaluation.cost - trial.evaluation.cost))
            if far and _at_noise(trial):
                reached = max(reached, promise.gain)
                if promise is not worthy[0]:
                    break
    return out


@dataclass(frozen=True)
class Amount:
    """How much of what a change of the model's amount explains, by trying it instead of to first order.

    It is tried over the second of HORIZONS: what rings is soon out of step everywhere else. Where much is
    left what that tells is told of all; near the noise it tells no more than it sees.
    """

    problem: Problem
    evaluation: Evaluation
    candidate: Candidate
    name: str  # of the parameter that an amount is a value of

    @cached_property
    def far(self) -> bool:
        """Whether much is left."""
        return misfit(self.evaluation) > NEAR_SQUARE

    @cached_property
    def part(self) -> Problem:
        """What amounts are tried on."""
        return shortened(self.problem, HORIZONS[-1])

    @cached_property
    def before(self) -> Evaluation | None:
        """That part without the change."""
        return evaluate(self.part, self.evaluation.point, residuals_only=True)

    def gain(self, amount: float) -> float:
        """What ``amount`` explains (nats) with everything else but start states as it is."""
        wide = extended(self.part, (self.candidate,))
        start = carried(wide, self.problem, self.evaluation.point)
        before = self.before
        try:
            point = _promised(wide, start, self.candidate, {self.name: amount}, self.evaluation)
            found = evaluate(wide, replace(point, starts=settled_starts(wide, point)), residuals_only=True)
        except FloatingPointError:
            return 0.0
        if before is None or found is None:
            return 0.0
        scale = excess(self.evaluation) / max(1.0, excess(before)) if self.far else 1.0
        return scale * (before.cost - found.cost)

    def best(self, amounts: list[float]) -> Promise:
        """The promise of the best of ``amounts``."""
        gains = [self.gain(amount) for amount in amounts]
        at = int(np.argmax(gains))
        return self._promise(amounts[at], gains[at])

    def refined(self, promise: Promise, spaced: float) -> Promise:
        """The promise with the best amount within a factor of ``spaced`` of its own."""
        amount = promise.values[self.name]
        found = minimize_scalar(
            lambda x: -self.gain(amount * float(np.exp(x))),
            bounds=(-np.log(spaced), np.log(spaced)),
            method="bounded",
            options={"xatol": 0.1},
        )
        better = self._promise(amount * float(np.exp(found.x)), -float(found.fun))
        return max(promise, better, key=lambda p: p.gain)

    def _promise(self, amount: float, gain: float) -> Promise:
        left = max(1.0, excess(self.evaluation))
        return Promise(self.candidate, max(0.0, gain), {self.name: amount}, max(0.0, gain) / left)


def supports(problem: Problem, evaluation: Evaluation, mass: float) -> list[Promise]:
    """What gives way, each scanned over its amount; nothing where the model gives way already."""
    rig, model = problem.bench.rig, problem.bench.parameters.model
    if gives_way(model):
        return []
    elasticity = cable_elasticity(rig, model, mass)
    tried = [Amount(problem, evaluation, elasticity, "cable.axial_stiffness")]
    for axis, a in enumerate(AXES):
        ceiling = ceiling_candidate(rig, model, mass, axis)
        tried.append(Amount(problem, evaluation, ceiling, f"ceiling.compliance.{a}"))
    # Near the noise little of it is seen: an amount that is not nearly right explains none of that
    spaced = SPACED if misfit(evaluation) > NEAR_SQUARE else FINELY
    stretches = usual_stiffness(rig, mass) * _spread(STRETCHES, spaced)
    sinks = largest_compliance(rig, mass) * _spread(SINKS, spaced)
    out = [amount.best(list(sinks if k else stretches)) for k, amount in enumerate(tried)]
    first = int(np.argmax([promise.gain for promise in out]))
    if out[first].gain > 0.0:
        out[first] = tried[first].refined(out[first], spaced)
    return out


def _spread(ends: tuple[float, float], spaced: float) -> Array:
    """Amounts from end to end, at most a factor of ``spaced`` apart."""
    count = int(np.ceil(np.log(ends[1] / ends[0]) / np.log(spaced))) + 1
    return np.asarray(np.geomspace(*ends, count))


def far_promises(
    problem: Problem, evaluation: Evaluation, promises: list[Promise], mass: float
) -> list[Promise]:
    """What gives way, and the best rider to one side and to all, whatever screening promises of them."""
    if gives_way(problem.bench.parameters.model):
        return []
    out = [p for p in supports(problem, evaluation, mass) if p.share > WORTH]
    riders = [p for p in promises if p.candidate.effect in ("liquid_slosh", "sprung_mass")]
    out += riders[:1]
    out += [p for p in promises if p.candidate.effect == "loose_mass"][:1]
    if riders and riders[0].candidate.effect == "sprung_mass":
        # What swings along one axis may swing to all sides
        first = riders[0]
        o = {p.name: p for p in first.candidate.parameters}
        swing = Swing("xy", o["sprung_mass.frequency"].nominal)
        at = np.array([o[f"sprung_mass.position.{a}"].nominal for a in AXES])
        liquid, values = rider_candidate(problem, swing, mass, first.values["sprung_mass.mass"], at)
        out.append(Promise(liquid, 0.0, values))
    return out
