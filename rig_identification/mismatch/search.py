"""From a session that the ideal model does not explain to the effects that do.

Screening (screen.py) ranks every hypothesis; the best few are fitted in full, in short
pieces first, where no model is far off; the most likely one stays (Laplace's approximation of the
marginal likelihood charges each free parameter for what it could have explained). Then the
whole runs are fitted with it, and if something is left the search goes on from there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rig_identification.estimate.growing import NEAR_SQUARE, misfit, settled_starts
from rig_identification.estimate.observability import invert_information
from rig_identification.estimate.parameters import AXES, INERTIAL
from rig_identification.estimate.solve import POLISH, Evaluation, Problem, evaluate, excess, solve
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.late import told_apart
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.locate import devices_of, find_liar
from rig_identification.mismatch.riders import SWINGS, Swing, rider_candidate
from rig_identification.mismatch.rig_errors import rig_errors
from rig_identification.mismatch.screen import Promise, carried, extended, screen
from rig_identification.mismatch.sensor_errors import sensor_errors
from rig_identification.mismatch.supports import cable_elasticity, ceiling_candidate, largest_compliance
from rig_identification.model.layout import RIGID

Array = NDArray[np.float64]
Notify = Callable[[str], None]

#: Chance that a session without any effect shows one, over all hypotheses together.
FALSE_ALARM = 0.005
#: Hypotheses fitted in full after each screening, and effects looked for at most.
FITTED = 4
MOST_EFFECTS = 2
#: A promise this much (nats) behind the best is not worth a fit, in parts of the best.
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
#: Steps of a first, short fit (more where the model itself changes) and of one to the end, and how many
#: hypotheses get that far.
FIRST_STEPS = 4
CHANGED_STEPS = 9
LAST_STEPS = 20
FINISHED = 3
#: Frequency (Hz) at which a body bounces on its cables where a fit of their stretch starts.
BOUNCE = 12.0


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
    wide = extended(problem, (candidate,))
    point = carried(wide, problem, evaluation.point)
    theta = point.theta.copy()
    for k, p in enumerate(candidate.built(problem.bench.parameters.model)[1]):
        if p.name not in promise.values:
            continue
        i = wide.bench.parameters.index_of(p.name)
        theta[i] = float(np.clip(p.position(promise.values[p.name]), -1.0, 1.0))
        if k < candidate.positive:
            theta[i] = max(theta[i], 0.0)
    if candidate.settle is not None:
        point = candidate.settle(wide, replace(point, theta=theta), evaluation)
    point = replace(point, theta=theta)
    try:
        if candidate.build is not None:
            # A changed model throws the start states out first, and everything else would bend to that
            point = replace(point, starts=settled_starts(wide, point))
        steps = FIRST_STEPS if candidate.build is None else CHANGED_STEPS
        fitted, settled = solve(wide, point, iterations=steps, tolerance=0.5, polish=POLISH)
    except FloatingPointError:
        return None
    return Trial(candidate, wide, fitted, log_evidence(fitted), settled and misfit(fitted) < NEAR_SQUARE)


def finished(trial: Trial) -> Trial | None:
    """The trial fitted to its end; None where its sign makes no sense there."""
    if not trial.settled:
        fitted, _ = solve(
            trial.problem, trial.evaluation.point, iterations=LAST_STEPS, tolerance=0.05, polish=POLISH
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


@dataclass(frozen=True)
class Trials:
    """Hypotheses fitted in full, most likely first, and the device that contradicts all others."""

    done: list[Trial]
    liar: str | None = None


def trials(
    problem: Problem, evaluation: Evaluation, candidates: list[Candidate], limit: float, notify: Notify
) -> Trials:
    """Full fits of the most promising hypotheses to the pieces that fit worst, most likely first.

    All get a few steps; the best few go on to their end, and where one reaches the noise only those
    that had come as close. Where much is left, what gives way is tried whatever screening
    says: it is far from linear.
    """
    mass = mass_of(problem, evaluation)
    far = misfit(evaluation) > NEAR_SQUARE
    liar = None
    if far:
        problem, evaluation = worst_pieces(problem, evaluation)
        if problem.bench.parameters.model.internal == 0:
            # With something that swings in the model such fits take minutes
            notify("without each device in turn")
            liar = find_liar(problem, evaluation)
        if liar is not None:
            # About the fit that does not hear it, what is wrong with it shows as it is
            evaluation = evaluate(problem, liar.point) or evaluation
            far = False
    promises = screen(problem, evaluation, candidates, mass)
    worthy = [p for p in promises if p.gain > needed_gain(p.candidate, len(candidates) + len(SWINGS))]
    if liar is not None:
        own = [p for p in worthy if p.candidate.where.get("channel") == liar.device]
        worthy = own or worthy
    worthy = [p for p in worthy if p.gain > WORTH * worthy[0].gain][:FITTED]
    if far:
        seen = {p.candidate.label for p in worthy}
        worthy += [p for p in far_promises(problem, promises, mass) if p.candidate.label not in seen]
    device = None if liar is None else liar.device
    if not worthy:
        return Trials([], device)
    ordinary = {p.name: p.prior_std for p in problem.bench.parameters.free if p.bounded}
    problem, evaluation = worst_pieces(problem, evaluation)
    needed = log_evidence(evaluation) + MEANT
    begun: list[Trial] = []
    for promise in worthy:
        notify(promise.candidate.label)
        trial = attempt(problem, evaluation, promise)
        if trial is not None:
            begun.append(trial)
            if far and _at_noise(trial):
                # From far off nothing reaches the noise by chance
                break
    begun.sort(key=lambda t: -t.evidence)
    done: list[Trial] = []
    for trial in begun:
        if len(done) == FINISHED:
            break
        if any(_at_noise(t) for t in done) and excess(trial.evaluation) > RIVAL * excess(begun[0].evaluation):
            continue
        notify(trial.candidate.label)
        ended = finished(trial)
        if ended is not None and ended.evidence > needed and beyond_doubt(ended, ordinary, limit):
            done.append(ended)
    return Trials(told_apart(done, MEANT), device)


def far_promises(problem: Problem, promises: list[Promise], mass: float) -> list[Promise]:
    """What gives way, and the best rider to one side and to all, whatever screening promises of them."""
    rig, model = problem.bench.rig, problem.bench.parameters.model
    if model.internal or not np.all(model.modes == RIGID):
        return []
    length = float(np.mean([c.length for c in rig.cables]))
    stiffness = mass * (2.0 * np.pi * BOUNCE) ** 2 * length / model.cables
    out = [Promise(cable_elasticity(rig, model, mass, stiffness), 0.0, {})]
    sink = 0.1 * largest_compliance(rig, mass)
    told = {p.candidate.label: p for p in promises}
    for axis, a in enumerate(AXES):
        ceiling = ceiling_candidate(rig, model, mass, axis)
        out.append(told.get(ceiling.label, Promise(ceiling, 0.0, {f"ceiling.compliance.{a}": sink})))
    riders = [p for p in promises if p.candidate.effect in ("liquid_slosh", "sprung_mass")]
    out += riders[:1]
    if riders and riders[0].candidate.effect == "sprung_mass":
        # What swings along one axis may swing to all sides
        first = riders[0]
        o = {p.name: p for p in first.candidate.parameters}
        swing = Swing("xy", o["sprung_mass.frequency"].nominal)
        at = np.array([o[f"sprung_mass.position.{a}"].nominal for a in AXES])
        liquid, values = rider_candidate(problem, swing, mass, first.values["sprung_mass.mass"], at)
        out.append(Promise(liquid, 0.0, values))
    return out
