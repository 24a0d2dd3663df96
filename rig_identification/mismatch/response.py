"""What a wrench over time does to every sample, to first order about a fitted motion.

Between nodes x_{k+1} = A_k x_k + B_k w_k, w_k being the interval's mean, and a sample at node k reads
H x_k + D w_k: whatever acts as a wrench can be screened by one pass of this recursion, without running the
model again.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rig_identification.estimate.prediction import Linearised
from rig_identification.estimate.whitening import whiten

Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def _respond(A, B, node, H, D, wrenches, smooth, out):  # type: ignore[no-untyped-def]
    """out (m, c): response of each row to ``wrenches`` (N, 6, c)."""
    states, count = A.shape[1], wrenches.shape[2]
    X = np.zeros((states, count))
    row = 0
    for k in range(A.shape[0]):
        while row < node.shape[0] and node[row] == k:
            for c in range(count):
                out[row, c] = 0.0
            for i in range(states):
                h = H[row, i]
                if h != 0.0:
                    for c in range(count):
                        out[row, c] += h * X[i, c]
            for i in range(6):
                h = D[row, i]
                if h != 0.0:
                    for c in range(count):
                        out[row, c] += h * wrenches[k, i, c]
            row += 1
        after = wrenches[min(k + 1, wrenches.shape[0] - 1)] if smooth else wrenches[k]
        X = np.dot(A[k], X) + np.dot(B[k], 0.5 * (wrenches[k] + after))


def whitened_response(run: Linearised, wrenches: Array, *, smooth: bool = False) -> Array:
    """(m, c): change of the run's whitened prediction under each of ``wrenches`` (N, 6, c), body axes.

    N and N m about the datum, held over each node interval; where ``smooth`` they run straight from node to
    node instead, and what follows a motion is not half an interval late.
    """
    A, B, _, _, _ = run.motion.derivatives
    columns = np.empty((run.nodes.size, wrenches.shape[2] + 1))
    columns[:, 0] = run.plain
    response = np.empty((run.nodes.size, wrenches.shape[2]))
    held = np.ascontiguousarray(wrenches)
    _respond(A, B, run.nodes, run.row_H, run.row_D, held, smooth, response)
    columns[:, 1:] = response
    if np.any(run.Q):
        whiten(A, B, run.Q, run.latent, run.nodes, run.row_H, run.row_D, run.variance, columns)
    else:
        columns /= np.sqrt(run.variance)[:, None]
    return columns[:, 1:]
