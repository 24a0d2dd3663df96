"""Inertia about another point and in other axes, with its uncertainty."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.result import InertialEstimate

Array = NDArray[np.float64]

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def inertia_about(estimate: InertialEstimate, point: Array, R_body_axes: Array) -> tuple[Array, Array]:
    """Inertia about a point of the body, and one standard deviation of each element.

    ``J_P = R^T (J + m (d.d 1 - d d^T)) R`` with ``d = c - P`` (parallel axes), whose derivatives in the ten
    elements carry their covariance over.

    Parameters
    ----------
    estimate : InertialEstimate
    point : (3,) array
        P, m, body.
    R_body_axes : (3, 3) array
        Columns are the new axes in body.

    Returns
    -------
    (3, 3) array, (3, 3) array
        kg m^2; NaN where an element that it depends on is not determined.
    """
    values = estimate.values
    mass, offset = values[0], values[1:4] - point
    unit = [_symmetric(row) for row in np.eye(6)]
    steiner = offset @ offset * np.eye(3) - np.outer(offset, offset)
    about = _symmetric(values[4:]) + mass * steiner
    slopes = [steiner]
    for axis in np.eye(3):
        lifted = 2.0 * (offset @ axis) * np.eye(3) - np.outer(offset, axis) - np.outer(axis, offset)
        slopes.append(mass * lifted)
    turned = np.array([R_body_axes.T @ slope @ R_body_axes for slope in (*slopes, *unit)])  # (10, 3, 3)
    # What an unknown element does not enter is known without it.
    known = np.isfinite(np.diag(estimate.covariance)) & np.isfinite(values)
    covariance = np.where(np.outer(known, known), estimate.covariance, 0.0)
    variance = np.einsum("aij,ab,bij->ij", turned, covariance, turned)
    lost = np.any(np.abs(turned[~known]) > 1e-12, axis=0)
    return (
        np.where(lost, np.nan, R_body_axes.T @ about @ R_body_axes),
        np.where(lost, np.nan, np.sqrt(np.maximum(variance, 0.0))),
    )


def _symmetric(six: Array) -> Array:
    matrix = np.zeros((3, 3))
    for (i, j), value in zip(_PAIRS, six, strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix
