"""What the recordings determine, read off the information matrix before anything is reported.

The covariance of the ten elements is that of the whole fit, every doubt about the rig
included. Beside it stands what one would believe of a body of this size without any
recording (the weak prior alone). An element whose standard deviation the recordings did
not bring to below ``GAIN`` of that belief is not determined: its value would be the prior's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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
    return np.asarray(scale[:, None] * np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-15) * scale)


def believed_std(problem: Problem, theta: Array) -> Array:
    """(10,) std of the elements by the weak prior alone, at this body."""
    map_ = problem.bench.parameters.elements_jacobian(theta)
    return np.asarray(np.sqrt(np.diag(map_ @ np.diag(problem.weak**2) @ map_.T)))


def inertial_estimate(problem: Problem, evaluation: Evaluation) -> InertialEstimate:
    """The ten numbers with their covariance and the names of those that stay undetermined."""
    theta = evaluation.point.theta
    covariance = elements_covariance(problem, evaluation)
    std = np.sqrt(np.diag(covariance))
    belief = believed_std(problem, theta)
    lost = tuple(name for name, s, b in zip(ELEMENTS, std, belief, strict=True) if not s < GAIN * b)
    return InertialEstimate(problem.bench.parameters.elements(theta), covariance, lost)
