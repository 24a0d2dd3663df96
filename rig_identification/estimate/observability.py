"""What the recordings determine, read off the information matrix before anything is reported.

The information of the recordings alone, every doubt about the rig integrated out, is set
beside what one would believe of a body of this weight on such a rig without any recording.
An element whose standard deviation the two together do not bring to below ``GAIN`` of the
belief's is not determined: its value would be the prior's, or follow only from the fact
that no mass is negative.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.result import ELEMENTS, InertialEstimate

Array = NDArray[np.float64]

#: Share of the belief's standard deviation above which an element counts as not determined.
GAIN = 1.0 / 3.0


def elements_covariance(problem: Problem, evaluation: Evaluation) -> Array:
    """(10, 10) Laplace covariance of mass, centre of mass and inertia."""
    covariance = invert_information(evaluation.information)[:10, :10]
    map_ = problem.bench.parameters.elements_jacobian(evaluation.point.theta)
    return np.asarray(map_ @ covariance @ map_.T)


def invert_information(information: Array) -> Array:
    """Inverse of an information matrix, scaled to unit diagonal first."""
    scale = 1.0 / np.sqrt(np.diag(information))
    return np.asarray(
        scale[:, None] * np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-15) * scale
    )


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
    taken off. Local and in the elements themselves: that mass must be positive tells
    nothing here.
    """
    full = evaluation.information
    inner, cross, rest = full[:INERTIAL, :INERTIAL], full[:INERTIAL, INERTIAL:], full[INERTIAL:, INERTIAL:]
    shared = inner - cross @ invert_information(rest) @ cross.T - np.diag(1.0 / problem.weak**2)
    map_ = np.linalg.inv(problem.bench.parameters.elements_jacobian(evaluation.point.theta))
    return np.asarray(map_.T @ shared @ map_)


def inertial_estimate(problem: Problem, evaluation: Evaluation) -> InertialEstimate:
    """The ten numbers with their covariance and the names of those that stay undetermined."""
    theta = evaluation.point.theta
    belief = believed_std(problem)
    scaled = data_information(problem, evaluation) * np.outer(belief, belief)
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    left = (vectors**2) @ (1.0 / (np.maximum(values, 0.0) + 1.0))
    lost = tuple(name for name, share in zip(ELEMENTS, left, strict=True) if not np.sqrt(share) < GAIN)
    covariance = elements_covariance(problem, evaluation)
    return InertialEstimate(problem.bench.parameters.elements(theta), covariance, lost)
