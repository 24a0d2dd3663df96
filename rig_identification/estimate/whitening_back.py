"""The filter of whitening.py taken back: its transpose.

Whitening is a linear map W of a column, and W^T W is the inverse of the samples' covariance. W^T of a
whitened Jacobian is therefore the inverse covariance times the Jacobian. Each step of the filter is linear;
taken back in the opposite order the steps make the transpose (the smoothing errors of Durbin & Koopman,
"Time Series Analysis by State Space Methods", 2012, section 4.5).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.estimate.whitening import followed


@njit(cache=True, nogil=True)
def whitened_back(A, B, node, H, D, gains, deviations, columns, follow):  # type: ignore[no-untyped-def]
    """Replace ``columns`` (m, c), whitened, by W^T of them. W: what whitening.whiten does to a column.

    gains (m, X + w), deviations (m,): of :func:`whitening.filter_of`; the other arguments are those of
    :func:`whitening.whiten`.
    """
    count, states = columns.shape[1], A.shape[1]
    size = states + B.shape[2]
    white = follow.shape[0] == 0
    back = np.ascontiguousarray(follow.T)
    X = np.zeros((size, count))
    F = np.empty((states, size))
    h = np.empty(size)
    row = columns.shape[0] - 1
    for k in range(A.shape[0] - 1, -1, -1):
        F[:, :states] = A[k]
        F[:, states:] = B[k]
        carried = np.dot(F.T, np.ascontiguousarray(X[:states]))
        for i in range(size):
            for c in range(count):
                X[i, c] = carried[i, c] + (X[i, c] if i >= states else 0.0)
        while row >= 0 and node[row] == k:
            h[:states] = H[row]
            h[states:] = D[row]
            for i in range(size):
                g = gains[row, i]
                if g != 0.0:
                    for c in range(count):
                        columns[row, c] += g * X[i, c]
            for c in range(count):
                columns[row, c] /= deviations[row]
            for i in range(size):
                if h[i] != 0.0:
                    for c in range(count):
                        X[i, c] -= h[i] * columns[row, c]
            row -= 1
        if k > 0:
            if white:
                X[states:] = 0.0
            else:
                followed(X[states:], back)
