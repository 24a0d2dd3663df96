"""What the recordings determine, read off the information matrix before anything is reported.

The information of the recordings alone, every doubt about the rig integrated out, is set
beside what one would believe of a body of this weight on such a rig without any recording.
An element whose standard deviation the two together do not bring to below ``GAIN`` of the
belief's is not determined: its value would be the prior's, or follow only from the fact
that no mass is negative.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.hung_by_eye import beside_middle
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, left_to_go
from rig_identification.model.definite import definite, integrated_out
from rig_identification.result import ELEMENTS, InertialEstimate, natural_size

Array = NDArray[np.float64]

#: Share of the belief's standard deviation above which an element counts as not determined.
GAIN = 1.0 / 3.0
#: The centre of mass among the elements, and where its entries begin in the body's vector.
CENTER, CENTER_ENTRY = ELEMENTS[1:4], 7
#: Factor on the noise of a channel that testifies for nothing.
SILENT = 1e3


def elements_covariance(problem: Problem, evaluation: Evaluation) -> Array:
    """(10, 10) Laplace covariance of mass, centre of mass and inertia."""
    map_ = problem.bench.parameters.elements_jacobian(evaluation.point.theta)
    root = root_of_inverse(evaluation.information)[:, :INERTIAL] @ map_.T
    return np.asarray(root.T @ root)


def unsettled(problem: Problem, evaluation: Evaluation) -> Array:
    """(10, 10) what the step that a fit has still to go adds to the covariance of the ten elements."""
    map_ = problem.bench.parameters.elements_jacobian(evaluation.point.theta)
    step = map_ @ left_to_go(problem, evaluation)[:10]
    return np.outer(step, step)


def invert_information(information: Array) -> Array:
    """Inverse of an information matrix: a covariance, with no variance below nothing."""
    root = root_of_inverse(information)
    return np.asarray(root.T @ root)


def root_of_inverse(information: Array) -> Array:
    """(n, n) W of which W^T W is the inverse of an information matrix, scaled to unit diagonal first."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    factor = np.linalg.cholesky(definite(information * np.outer(scale, scale)))
    return np.asarray(solve_triangular(factor, np.diag(scale), lower=True))


def believed_std(problem: Problem) -> Array:
    """(10,) std of mass, centre of mass and inertia of a body of which only rig and weight are known."""
    parameters = problem.bench.parameters
    rough = np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)])
    elements = parameters.elements(rough)
    size = float(np.max(extent(problem.bench.rig)))
    inertia = float(np.mean(elements[[4, 7, 9]]))
    return np.concatenate([[0.5 * elements[0]], np.full(3, size), np.full(6, inertia)])


def data_information(problem: Problem, evaluation: Evaluation) -> Array:
    """(10, 10) information on the ten elements from recordings and scale alone.

    Doubts about the rig and start states are integrated out; the weak prior on the body is
    taken off, but for what is believed of it. Local and in the elements themselves: that mass must be
    positive tells nothing here.
    """
    vague = 1.0 / problem.weak**2
    vague[list(problem.taken)] = 0.0
    shared = integrated_out(evaluation.information, INERTIAL) - np.diag(vague)
    map_ = np.linalg.inv(problem.bench.parameters.elements_jacobian(evaluation.point.theta))
    return np.asarray(map_.T @ shared @ map_)


def inertial_estimate(problem: Problem, evaluation: Evaluation) -> InertialEstimate:
    """The ten numbers with their covariance and the names of those that stay undetermined."""
    theta = evaluation.point.theta
    left = share_left(problem, evaluation)
    believed = {name for i, name in enumerate(CENTER, start=CENTER_ENTRY) if i in problem.taken}
    lost = with_products(
        {n for n, share in zip(ELEMENTS, left, strict=True) if n in believed or not share < GAIN}
    )
    elements = problem.bench.parameters.elements(theta)
    beside = beside_middle(problem, elements)
    covariance = elements_covariance(problem, evaluation) + np.outer(beside, beside)
    return InertialEstimate(elements, covariance, lost)


def believed_point(problem: Problem, evaluation: Evaluation) -> Array:
    """The vector with a body of the weak prior's shape, as large about the vertical and as heavy as fitted.

    A fit that lacks something may end at a body thin to nothing, where a little inertia
    changes the motion without limit: information there is of the corner, not of the body.
    """
    parameters = problem.bench.parameters
    theta: Array = evaluation.point.theta.copy()
    fitted = parameters.elements(theta)
    shape = parameters.elements(np.concatenate([problem.weak_center, theta[INERTIAL:]]))
    shape[4:] *= fitted[9] / shape[9]
    shape[0] = fitted[0]
    theta[:INERTIAL] = parameters.start(shape)[:INERTIAL]
    return theta


def share_left(problem: Problem, evaluation: Evaluation) -> Array:
    """(10,) std of each element as a share of the belief's, belief and recordings together."""
    belief = believed_std(problem)
    scaled = data_information(problem, evaluation) * np.outer(belief, belief)
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    return np.asarray(np.sqrt((vectors**2) @ (1.0 / (np.maximum(values, 0.0) + 1.0))))


def testimony(
    problem: Problem, evaluation: Evaluation, predicted: dict[tuple[str, str, int], float], left: float
) -> tuple[str, ...]:
    """Elements that channels which the model does not predict would have to tell, or none tells.

    predicted: (device, quantity, axis) -> residual of a run predicted without a fit as a share of
    its signal. A channel missed by more than ``GAIN`` of its motion testifies for nothing. left: squared
    length of what the fit leaves beyond noise (cautious.left_beyond_noise). An element that shows by less
    than all of that could be bent to anything, and is not told.
    """
    runs, bent = [], np.sqrt(1.0 + min(left, SILENT**2))
    for run in problem.runs:
        channels = []
        for c in run.channels:
            mute = [predicted.get((c.device, c.quantity, a), 0.0) > GAIN for a in c.axes]
            channels.append(replace(c, noise=bent * np.where(mute, SILENT, 1.0) * c.noise))
        runs.append(replace(run, channels=tuple(channels)))
    heard = replace(problem, runs=tuple(runs))
    lost: set[str] = set()
    for theta in (evaluation.point.theta, believed_point(problem, evaluation)):
        there = evaluate(heard, replace(evaluation.point, theta=theta))
        if there is not None:
            std = share_left(heard, there) * believed_std(heard)
            size = natural_size(problem.bench.parameters.elements(theta))
            lost |= {name for name, s in zip(ELEMENTS, std / size, strict=True) if not s < GAIN}
    return with_products(lost)


def with_products(lost: set[str]) -> tuple[str, ...]:
    """The elements of ``lost`` in their order, and each product of inertia with a moment among them.

    A product counts against the moments about its two axes: without them it tells nothing.
    """
    idle = {name for name in ELEMENTS if name[0] == "J" and {f"J{a}{a}" for a in name[1:]} & lost}
    return tuple(name for name in ELEMENTS if name in lost | idle)
