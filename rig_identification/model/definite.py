"""Symmetric matrices that are positive definite but for rounding.

An information matrix J^T J + prior, a mass matrix, a covariance: none has a direction of less than nothing.
In floating point each of its n^2 entries is off by some parts in 1e16 of the two diagonal ones, and where the
conditions of directions differ by more than that the smallest eigenvalues come out as anything about zero, of
either sign. What stands there is no knowledge, and a little of it is added instead.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Factor by which more is added where a part does not do.
MORE = 10.0


def definite(matrix: Array) -> Array:
    """The symmetric ``matrix`` (n, n) itself where it has a Cholesky factor; else the nearest that is tried.

    Its diagonal is brought to one, and to that is added what rounding may have taken away, n times the
    machine's precision, or as much more as it takes: Nocedal and Wright, "Numerical Optimization", 2006,
    algorithm 3.3. What is not finite cannot be mended, and raises ``numpy.linalg.LinAlgError``.
    """
    if not np.all(np.isfinite(matrix)):
        raise np.linalg.LinAlgError("a matrix holds what is no number")
    if _has_factor(matrix):
        return matrix
    eps, tiny = np.finfo(float).eps, np.finfo(float).tiny
    diagonal = np.diag(matrix)
    scale = np.sqrt(np.maximum(diagonal, max(float(np.max(diagonal)) * eps**2, np.sqrt(tiny))))
    unit = 0.5 * (matrix + matrix.T) / np.outer(scale, scale)
    added = float(unit.shape[0] * eps)
    while not _has_factor(unit + added * np.eye(unit.shape[0])):
        added *= MORE
    return np.asarray((unit + added * np.eye(unit.shape[0])) * np.outer(scale, scale))


def _has_factor(matrix: Array) -> bool:
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return True
