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

from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Problem, solve
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.left_out_physics import left_out_physics
from rig_identification.mismatch.rig_errors import rig_errors
from rig_identification.mismatch.riders import SWINGS
from rig_identification.mismatch.screen import Promise, carried, extended, screen
from rig_identification.mismatch.sensor_errors import sensor_errors

Array = NDArray[np.float64]
Notify = Callable[[str], None]

#: Chance that a session without any effect shows one, over all hypotheses together.
FALSE_ALARM = 0.005
#: Hypotheses fitted in full after each screening, and effects looked for at most.
FITTED = 4
MOST_EFFECTS = 3
#: A promise this much (nats) behind the best is not worth a fit, in parts of the best.
WORTH = 0.05
#: Mean square of whitened residuals below which nothing much is left, and the share of the best promise
#: that makes a rival of it even so.
AT_NOISE = 1.05
RIVAL = 0.9


@dataclass(frozen=True)
class Trial:
    """A hypothesis fitted in full."""

    candidate: Candidate
    problem: Problem
    evaluation: Evaluation
    evidence: float  # log marginal likelihood less a constant


def catalogue(problem: Problem) -> list[Candidate]:
    """Every hypothesis that this session's rig and channels admit."""
    rig, parameters = problem.bench.rig, problem.bench.parameters
    mass = float(
        parameters.elements(np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)]))[0]
    )
    return [
        *sensor_errors(rig, parameters),
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


def attempt(problem: Problem, evaluation: Evaluation, promise: Promise) -> Trial | None:
    """Fit one hypothesis from what screening promised; None where its sign makes no sense."""
    candidate = promise.candidate
    wide = extended(problem, (candidate,))
    point = carried(wide, problem, evaluation.point)
    theta = point.theta.copy()
    for k, p in enumerate(candidate.built(problem.bench.parameters.model)[1]):
        if p.name not in promise.values:
            continue
        i = wide.bench.parameters.index_of(p.name)
        theta[i] = float(np.clip(p.position(promise.values[p.name]), -1.0, 1.0))
        if candidate.positive and k == 0:
            theta[i] = max(theta[i], 0.0)
    if candidate.settle is not None:
        point = candidate.settle(wide, replace(point, theta=theta), evaluation)
    try:
        fitted, _ = solve(wide, replace(point, theta=theta), iterations=10, tolerance=0.05)
    except FloatingPointError:
        return None
    if candidate.positive:
        i = wide.bench.parameters.index_of(candidate.parameters[0].name)
        if fitted.point.theta[i] <= 0.0:
            return None
    return Trial(candidate, wide, fitted, log_evidence(fitted))


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


def _at_noise(trial: Trial) -> bool:
    """Whether a hypothesis leaves residuals of the size of the noise."""
    residuals = np.concatenate([run.residual for run in trial.evaluation.runs])
    return float(np.mean(residuals**2)) < AT_NOISE


def trials(
    problem: Problem, evaluation: Evaluation, candidates: list[Candidate], limit: float, notify: Notify
) -> list[Trial]:
    """Full fits of the most promising hypotheses, most likely first."""
    promises = screen(problem, evaluation, candidates, mass_of(problem, evaluation))
    worthy = [p for p in promises if p.gain > needed_gain(p.candidate, len(candidates) + len(SWINGS))]
    if not worthy:
        return []
    ordinary = {p.name: p.prior_std for p in problem.bench.parameters.free if p.bounded}
    done: list[Trial] = []
    for promise in [p for p in worthy if p.gain > WORTH * worthy[0].gain][:FITTED]:
        if any(_at_noise(t) for t in done) and promise.gain < RIVAL * worthy[0].gain:
            break
        notify(promise.candidate.label)
        trial = attempt(problem, evaluation, promise)
        if trial is not None and beyond_doubt(trial, ordinary, limit):
            done.append(trial)
    return sorted(done, key=lambda t: -t.evidence)
