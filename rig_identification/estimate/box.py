"""The minimum of a convex quadratic in a box."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import lsq_linear

Array = NDArray[np.float64]

#: Rounds in which all that is on the wrong side changes sides at once, and what counts as zero there.
PIVOTS, BARELY = 20, 1e-9


def in_box(matrix: Array, right: Array, low: Array, high: Array) -> Array:
    """The x (n,) in [low, high] that minimises x^T matrix x / 2 - right^T x; matrix (n, n) positive definite.

    Block principal pivoting: what passes a bound goes onto it, what is pressed inwards from one comes free
    (Portugal, Judice and Vicente, "A comparison of block pivoting and interior-point algorithms for linear
    least squares problems with nonnegative variables", 1994). It ends after a few rounds, or hardly ever does
    not; bounded-variable least squares then, which is certain and slow (Stark and Parker, 1995).
    """
    if not right.size:
        # Of a rig that is described without any tolerance nothing is in doubt
        return np.zeros(0)
    side = np.zeros(right.size, dtype=np.int64)  # -1 at low, 1 at high
    scale = np.sqrt(np.diag(matrix))
    for _ in range(PIVOTS):
        x = np.where(side < 0, low, high)
        free = side == 0
        held = ~free
        x[free] = np.linalg.solve(
            matrix[np.ix_(free, free)], right[free] - matrix[np.ix_(free, held)] @ x[held]
        )
        pull = (right - matrix @ x) / scale
        over, under = free & (x * scale > high * scale + BARELY), free & (x * scale < low * scale - BARELY)
        loose = held & (side * pull < -BARELY * np.max(np.abs(right / scale)))
        if not np.any(over | under | loose):
            return np.clip(x, low, high)
        side = np.where(over, 1, np.where(under, -1, np.where(loose, 0, side)))
    root = np.linalg.cholesky(matrix)
    target = solve_triangular(root, right, lower=True)
    return np.asarray(np.clip(lsq_linear(root.T, target, (low, high), method="bvls").x, low, high))
