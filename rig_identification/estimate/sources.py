r"""The covariance of the ten numbers by source: what each channel, tolerance and belief adds to it.

The estimate is linear in its inputs, to first order. With the information I = J^T S^-1 J + P of all samples
(covariance S) and priors (precision P), an error e of the samples moves it by C J^T S^-1 e, C = I^-1, and an
error of a prior's center by C P e. Sources that are independent of each other therefore add up,

    C = sum_k C A_k C,    A_k = (S^-1 J)^T R_k (S^-1 J)  of a channel whose noise has the covariance R_k,
                          A_k = P_k                       of a prior,

which is the uncertainty budget of JCGM 100:2008 (GUM), equation 13. What the samples' covariance holds beside
the channels' own noise is that of the exciter's force, which drives the body.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.observability import root_of_inverse
from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.estimate.prediction import Linearised
from rig_identification.estimate.rest_evidence import BLOCKS, RestChannel, RestLinearised
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.whitening_back import whitened_back
from rig_identification.model.definite import definite
from rig_identification.result import InertialEstimate, UncertaintySource

Array = NDArray[np.float64]

#: Names of the rows of noise that enters as force, and of what rivals, headings and the last step add.
FORCE, WRENCH, RIVALS = "exciter force", "exciter force and random wrench", "other explanations"
#: Share of the whole below which what is left after all named sources is rounding.
ROUNDING = 1e-7
#: Which key of the description's ``tolerance`` holds a doubt, by the end of its name less its axis.
_TOLERANCE = {
    "length": "cable_length",
    "ceiling_point": "hinge_position",
    "body_point": "hinge_position",
    "level": "level",
    "clock": "clock",
    "load_cell_gain": "load_cell_gain",
    "load_cell_zero": "load_cell_zero",
    "gyroscope_bias": "gyroscope_bias",
    "gyroscope_scale": "gyroscope_scale",
    "accelerometer_bias": "accelerometer_bias",
    "accelerometer_scale": "accelerometer_scale",
    "exciter.gain": "exciter_gain",
    "exciter.position": "exciter_position",
    "exciter.orientation": "exciter_orientation",
    "imu.position": "imu_position",
    "imu.orientation": "imu_orientation",
    "inclinometer.orientation": "inclinometer_orientation",
    "mocap.marker_position": "imu_position",
    "mocap.marker_orientation": "imu_orientation",
}


@dataclass(frozen=True)
class _Part:
    """One source's part: what each of its independent errors, of one std, moves the ten numbers by."""

    name: str
    kind: str
    moves: Array  # (r, 10)
    freedom: float | None = None


def with_sources(
    total: InertialEstimate, problem: Problem, evaluation: Evaluation, loose: float = 1.0
) -> InertialEstimate:
    """The estimate with the sources of its covariance, which add up to it.

    problem, evaluation: the fit that it comes from. loose: factor that its covariance was widened by. What
    the fit's own sources do not account for stands in a row of its own (:data:`RIVALS`).
    """
    found = tuple(replace(s, covariance=loose * s.covariance) for s in sources(problem, evaluation))
    return closed(replace(total, sources=found))


def closed(total: InertialEstimate) -> InertialEstimate:
    """The estimate, with a source that holds what those it has do not account for, rounding among it.

    Where that is but rounding the largest source takes it, so that the rows add up to the last digit.
    """
    told = np.sum([s.covariance for s in total.sources], axis=0)
    left = np.asarray(total.covariance - told)
    scale = np.sqrt(np.maximum(np.diag(total.covariance), np.finfo(float).tiny))
    if float(np.max(np.abs(left / np.outer(scale, scale)))) > ROUNDING:
        return replace(total, sources=(*total.sources, UncertaintySource(RIVALS, "model", left)))
    largest = int(np.argmax([float(np.sum(np.diag(s.covariance) / scale**2)) for s in total.sources]))
    rows = list(total.sources)
    rows[largest] = replace(rows[largest], covariance=rows[largest].covariance + left)
    return replace(total, sources=tuple(rows))


def sources(problem: Problem, evaluation: Evaluation) -> tuple[UncertaintySource, ...]:
    """What each source adds to the covariance of the ten numbers, channels first."""
    root = root_of_inverse(evaluation.information)
    map_ = problem.bench.parameters.elements_jacobian(evaluation.point.theta)
    # (n, 10): what a unit of gradient moves each of the ten by
    moved = root.T @ (root[:, :INERTIAL] @ map_.T)
    whole = moved.T @ evaluation.information @ moved
    found: dict[tuple[str, str], UncertaintySource] = {}
    for part in _parts(problem, evaluation, moved):
        own = part.moves
        known = found.get((part.name, part.kind))
        before = np.zeros((INERTIAL, INERTIAL)) if known is None else known.covariance
        freedom = _together(None if known is None else known.degrees_of_freedom, part.freedom)
        found[part.name, part.kind] = UncertaintySource(part.name, part.kind, before + own.T @ own, freedom)
    left = whole - np.sum([s.covariance for s in found.values()], axis=0)
    scale = np.sqrt(np.maximum(np.diag(whole), np.finfo(float).tiny))
    if float(np.max(np.diag(left) / scale**2)) > ROUNDING:
        name, kind = _unnamed(problem, evaluation)
        found[name, kind] = UncertaintySource(name, kind, left)
    return tuple(found.values())


def _unnamed(problem: Problem, evaluation: Evaluation) -> tuple[str, str]:
    """Name and kind of what the channels' noise and the priors do not account for."""
    if problem.discrepancy is not None or problem.extra_noise is not None:
        return WRENCH, "noise"
    if any(bool(np.any(run.noise.Q)) for run in evaluation.runs):
        return FORCE, "noise"
    return "belief about each run's start", "belief"


def _together(one: float | None, other: float | None) -> float | None:
    """Degrees of freedom of one noise that several recordings tell; None: stated."""
    return None if one is None and other is None else (one or 0.0) + (other or 0.0)


def _parts(problem: Problem, evaluation: Evaluation, moved: Array) -> Iterator[_Part]:
    """Every source. moved (n, 10): what a unit of gradient of each unknown moves the ten numbers by."""
    shared = place = problem.bench.parameters.size
    for run, linearised in zip(problem.runs, evaluation.runs, strict=True):
        starts = linearised.jacobian.shape[1] - shared
        own = np.concatenate([moved[:shared], moved[place : place + starts]])
        yield from _of_run(run, linearised, own)
        place += starts
    for evidence, rest in zip(problem.rests, evaluation.rests, strict=True):
        yield from _of_rest(problem, evidence.channels, rest, moved[:shared])
    yield from _of_priors(problem, evaluation.point.theta, moved[:shared])


def _of_run(run: Run, linearised: Linearised, moved: Array) -> Iterator[_Part]:
    """Each channel's noise in motion."""
    whitened = linearised.jacobian @ moved
    zeros = linearised.wander.responses.T @ linearised.wander.without(whitened)
    yield _Part("zeros from one recording to the next", "noise", zeros, None)
    back = undone(linearised, whitened)
    back *= np.sqrt(linearised.variance)[:, None]
    for index, channel in enumerate(run.channels):
        freedom = float(channel.values.size) if channel.noise_estimated else None
        name = f"{channel.device} {channel.quantity.replace('_', ' ')}"
        yield _Part(name, "noise", back[linearised.channel == index], freedom)


def undone(linearised: Linearised, whitened: Array) -> Array:
    """(m, c) inverse covariance of a run's samples times columns that come ``whitened`` (m, c)."""
    gains, deviations = linearised.filter
    noise, columns = linearised.noise, linearised.wander.without(whitened)
    if not np.any(noise.Q):
        return np.asarray(columns / deviations[:, None])
    whitened_back(
        linearised.motion.derivatives[0],
        noise.through,
        linearised.nodes,
        linearised.row_H,
        noise.felt,
        gains,
        deviations,
        columns,
        noise.follow,
    )
    return np.asarray(columns)


def _of_rest(
    problem: Problem, channels: tuple[RestChannel, ...], rest: RestLinearised, moved: Array
) -> Iterator[_Part]:
    """Each channel's mean at rest. A wrench that the model lacks is whitened away as in motion."""
    rows = rest.jacobian
    if problem.discrepancy is not None:
        # Of f = L^-1 F, with 1 + F D F^T = L L^T, the Cholesky factor of 1 - f D f^T is L^-1
        felt = rest.felt
        inside = np.eye(felt.shape[0]) - felt @ problem.discrepancy.covariance @ felt.T
        rows = np.linalg.cholesky(definite(inside)).T @ rows
    first = 0
    for channel in channels:
        here = rows[first : first + channel.mean.size] @ moved
        first += channel.mean.size
        name = f"{channel.device} {channel.quantity.replace('_', ' ')} at rest"
        yield _Part(name, "rest", here, BLOCKS - 1.0 if channel.scattered else None)


def _of_priors(problem: Problem, theta: Array, moved: Array) -> Iterator[_Part]:
    """Tolerances, the ground scale, and what is believed of a body before anything is measured."""
    parameters = problem.bench.parameters
    body = moved[:INERTIAL]
    yield _Part("belief about the body", "belief", body / problem.weak[:, None])
    if problem.mass is not None:
        row = parameters.elements_jacobian(theta)[:1] / problem.mass[1]
        yield _Part("ground scale", "scale", row @ body)
    for column, parameter in enumerate(parameters.free, start=INERTIAL):
        yield _Part(*prior_name(parameter), moved[column : column + 1])


def prior_name(parameter: Parameter) -> tuple[str, str]:
    """Name and kind of the source that a parameter's prior is: a described tolerance, or a belief."""
    parts = parameter.name.split(".")
    stem = parts[:-1] if parts[-1] in ("x", "y", "z") else parts
    key = _TOLERANCE.get(".".join(stem[-2:])) or _TOLERANCE.get(stem[-1])
    if key is None or parameter.freed:
        return f"range of {'.'.join(stem)}", "belief"
    return f"tolerance.{key}", "tolerance"
