"""The main job: from a session to mass, centre of mass and inertia with their intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.estimate.channel_fits import rest_fits, run_fits
from rig_identification.estimate.evidence import Run, prepare
from rig_identification.estimate.first_guess import first_elements, weak_prior
from rig_identification.estimate.growing import fit_start_growing, solve_growing
from rig_identification.estimate.launch import Launch, launch_state
from rig_identification.estimate.observability import inertial_estimate, invert_information
from rig_identification.estimate.parameters import INERTIAL, parameter_set
from rig_identification.estimate.prediction import Bench, Linearised
from rig_identification.estimate.rest_evidence import prepare_rest
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.verdict import judge
from rig_identification.estimate.without_frame import subtract_frame
from rig_identification.model.motion import rig_model
from rig_identification.recording import Session
from rig_identification.result import Identification, ParameterEstimate

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

#: The ideal model may differ from its description by so many tolerances (recording contract).
ORDINARY = 3.0


@dataclass(frozen=True)
class Fitted:
    """A solved problem and how its held-out runs came out."""

    problem: Problem
    evaluation: Evaluation
    converged: bool
    holdout_runs: tuple[Run, ...]
    holdouts: tuple[Linearised, ...]


def _silent(stage: str, fraction: float) -> None:
    _ = stage, fraction


def pose_problem(session: Session) -> tuple[Problem, Array, tuple[Run, ...]]:
    """What is to be fitted, the vector of a first guess from geometry alone, and the held-out runs.

    Raises InputError where no recording holds a device that the description mounts.
    """
    rig = session.rig
    elements = first_elements(session)
    model = rig_model(rig, elements)
    runs = tuple(prepare(rig, recording) for recording in session.training)
    held = tuple(prepare(rig, recording) for recording in session.holdouts)
    rests = tuple(prepare_rest(rig, recording) for recording in session.statics)
    channels = {c.device for run in (*runs, *held) for c in run.channels}
    channels |= {c.device for evidence in rests for c in evidence.channels}
    if not channels:
        raise InputError(
            f"{session.name}: no recording holds a cable's tension, an IMU, an inclinometer or motion "
            "capture that the rig description mounts; record or describe at least one of them"
        )
    parameters = parameter_set(rig, model, channels)
    theta = parameters.start(elements)
    mass = None if rig.mass is None else (rig.mass, rig.mass_std if rig.mass_std is not None else 1e-3 * rig.mass)
    problem = Problem(
        Bench(rig, parameters), runs, rests, mass, weak_prior(rig), theta[:INERTIAL].copy(), bound=ORDINARY
    )
    return problem, theta, held


def fit_session(session: Session, progress: Progress = _silent) -> Fitted:
    """Fit the ideal model to a session and predict its held-out runs."""
    progress("first guess from rest and geometry", 0.0)
    problem, theta, held = pose_problem(session)
    start = Launch(problem, theta)
    start = start.from_rest()
    progress("first guess from momentum", 0.05)
    start = start.from_momentum()
    evaluation, converged = solve_growing(
        problem, start.point(), notify=lambda fraction, text: progress(f"fit: {text}", 0.15 + 0.6 * fraction)
    )
    progress("predicting held-out runs", 0.8)
    outcomes = []
    for run in held:
        state = start.rest if start.rest is None else launch_state(problem.bench, run, evaluation.point.theta, start.rest)
        result = fit_start_growing(problem.bench, run, evaluation.point.theta, state)
        if result is not None:
            outcomes.append((run, result[0]))
    return Fitted(
        problem,
        evaluation,
        converged,
        tuple(run for run, _ in outcomes),
        tuple(linearised for _, linearised in outcomes),
    )


def parameter_estimates(problem: Problem, evaluation: Evaluation) -> tuple[ParameterEstimate, ...]:
    """Every doubt about the rig: what was believed and what the recordings made of it."""
    parameters = problem.bench.parameters
    covariance = invert_information(evaluation.information)
    values = parameters.values(evaluation.point.theta)
    out = []
    for i, p in enumerate(parameters.free):
        std = p.prior_std * float(np.sqrt(covariance[INERTIAL + i, INERTIAL + i]))
        out.append(ParameterEstimate(p.name, p.unit, p.nominal, p.prior_std, float(values[i]), std))
    return tuple(out)


def identify(session: Session, progress: Progress | None = None) -> Identification:
    """Mass, centre of mass, inertia tensor and whether the ideal model explains the session.

    Raises InputError where the session holds nothing to fit.
    """
    notify = progress or _silent
    fitted = fit_session(session, notify)
    problem, evaluation = fitted.problem, fitted.evaluation
    total = inertial_estimate(problem, evaluation)
    frame = session.rig.frame
    fits = []
    for run, linearised in zip(problem.runs, evaluation.runs, strict=True):
        fits += run_fits(problem, run, linearised, evaluation.point.theta)
    training_error = error_in_sigma(fits)
    for evidence, rest in zip(problem.rests, evaluation.rests, strict=True):
        fits += rest_fits(evidence, rest)
    held_fits = []
    for run, linearised in zip(fitted.holdout_runs, fitted.holdouts, strict=True):
        held_fits += run_fits(problem, run, linearised, evaluation.point.theta)
    holdout_error = error_in_sigma(held_fits) if held_fits else None
    parameters = parameter_estimates(problem, evaluation)
    mismatch = judge(fitted, parameters, holdout_error, training_error, ORDINARY)
    notify("done", 1.0)
    return Identification(
        total=total,
        without_frame=None if frame is None else subtract_frame(total, frame),
        mismatch=mismatch,
        parameters=parameters,
        channels=tuple(fits + held_fits),
        holdout_error=holdout_error,
        training_error=training_error,
        converged=fitted.converged,
    )


def error_in_sigma(fits) -> float:  # type: ignore[no-untyped-def]
    """Root mean square of all residuals, each in units of its sensor's noise."""
    if not fits:
        return float("nan")
    total = sum(float(np.sum(fit.residual_in_sigma**2)) for fit in fits)
    return float(np.sqrt(total / sum(fit.time.size for fit in fits)))
