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

#: Factor by which more is added where so much does not do.
MORE = 10.0


def definite(matrix: Array) -> Array:
    """The symmetric ``matrix`` (n, n) itself where its Cholesky factor says that it is; else one beside it.

    Its diagonal is brought to one. Where a pivot then lies below what rounding may make of nothing, n times
    the machine's precision, so much is added to the diagonal, or as much more as it takes: Nocedal and
    Wright, "Numerical Optimization", 2006, algorithm 3.3. What is not finite cannot be mended, and raises
    ``numpy.linalg.LinAlgError``.
    """
    if not np.all(np.isfinite(matrix)):
        raise np.linalg.LinAlgError("a matrix holds what is no number")
    eps, tiny = np.finfo(float).eps, np.finfo(float).tiny
    diagonal = np.diag(matrix)
    least = max(float(np.max(diagonal, initial=0.0)) * eps**2, np.sqrt(tiny))
    scale = np.sqrt(np.maximum(diagonal, least))
    unit = 0.5 * (matrix + matrix.T) / np.outer(scale, scale)
    rounding = float(diagonal.size * eps)
    if _is_above(rounding, unit):
        return matrix
    added = 2.0 * rounding
    while not _is_above(rounding, unit + added * np.eye(diagonal.size)):
        added *= MORE
    return np.asarray((unit + added * np.eye(diagonal.size)) * np.outer(scale, scale))


def integrated_out(information: Array, kept: int) -> Array:
    """(kept, kept) information on the first ``kept`` parameters, with all others integrated out.

    It is the Schur complement, and the last block of the Cholesky factor of the matrix with the others
    first. Taken as a difference it would lose its digits where those are known far better than the first.
    """
    order = np.roll(np.arange(information.shape[0]), -kept)
    scale = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))[order]
    unit = information[np.ix_(order, order)] / np.outer(scale, scale)
    block = scale[-kept:, None] * np.linalg.cholesky(definite(unit))[-kept:, -kept:]
    return np.asarray(block @ block.T)


def _is_above(least: float, matrix: Array) -> bool:
    """Whether every pivot of a Cholesky factor lies above ``least``."""
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return False
    return bool(np.min(np.diag(factor) ** 2, initial=np.inf) > least)
