"""Prediction errors of a motion that noise drives as force: one Kalman pass, any number of columns.

About the nominal motion, x_{k+1} = A_k x_k + B_k w_k with w_k ~ N(0, Q_k) white, and a grouped
sample at node k reads H x_k + D w_k + e. The filter's innovations, divided by their own
standard deviation, are white under the model (Kailath, IEEE TAC 13, 1968); what it does
to the residual it does to every column of the Jacobian, and least squares on the result
is generalised least squares with the exact covariance of force and sensor noise. The sum
of log standard deviations is what the marginal likelihood needs beside it.

Noise that is not white is in state space, component by component of a force: w_{k+1} = F w_k + q_k with q_k
white (force_noise.py). F of no rows: w_k is white itself.
"""

from __future__ import annotations

import numpy as np
from numba import njit

#: Components of a force, of which each has noise of its own where that is not white.
ONE = 3


@njit(cache=True, nogil=True)
def _drawn(P, Q, follow, k):  # type: ignore[no-untyped-def]
    """Write into ``P`` what noise may drive the interval after node ``k``.

    Q (n, w, w): what is drawn at each node, from n - 1 on as at that one. follow (f, f): F of each component.
    """
    size, width, order = P.shape[0], Q.shape[1], follow.shape[0]
    states = size - width
    new = Q[min(k, Q.shape[0] - 1)]
    if order == 0 or k == 0:
        for i in range(states, size):
            for j in range(states):
                P[i, j] = 0.0
                P[j, i] = 0.0
            for j in range(states, size):
                P[i, j] = new[i - states, j - states]
        return
    followed(P[states:], follow)
    for i in range(states, size):
        for j in range(states):
            P[j, i] = P[i, j]
    # The other side of the noise's own block
    own = P[states:, states:].T.copy()
    followed(own, follow)
    for i in range(width):
        for j in range(width):
            P[states + i, states + j] = own[j, i] + new[i, j]


@njit(cache=True, nogil=True)
def followed(X, follow):  # type: ignore[no-untyped-def]
    """Take rows ``X`` (w, c) of noise from one node to the next, where white noise is over."""
    order, count = follow.shape[0], X.shape[1]
    if order == 0:
        X[:] = 0.0
        return
    old = X.copy()
    for i in range(order):
        for axis in range(ONE):
            for c in range(count):
                X[ONE * i + axis, c] = 0.0
            for j in range(order):
                share = follow[i, j]
                if share != 0.0:
                    for c in range(count):
                        X[ONE * i + axis, c] += share * old[ONE * j + axis, c]


@njit(cache=True, nogil=True)
def _expected(X, states, latent, follow, k):  # type: ignore[no-untyped-def]
    """Write what is expected of the noise after node ``k`` into ``X`` (x + w, c): column 0 is a residual."""
    if k > 0:
        followed(X[states:], follow)
    if follow.shape[0] == 0:
        for i in range(states, X.shape[0]):
            X[i, 0] -= latent[k, i - states]
        return
    # What the nominal motion holds is expected to go on as the noise does: it was drawn where it departs
    held = latent.shape[1]
    for i in range(held):
        X[states + i, 0] -= latent[k, i]
    if k > 0:
        for i in range(X.shape[0] - states):
            for j in range(i % ONE, held, ONE):
                X[states + i, 0] += follow[i // ONE, j // ONE] * latent[k - 1, j]


@njit(cache=True, nogil=True)
def _moved_on(P, F, white):  # type: ignore[no-untyped-def]
    """Carry the state's part of ``P`` to the next node by ``F`` (X, X + w); white: noise is then over."""
    states = F.shape[0]
    after = np.dot(F, P)
    P[:states, :states] = np.dot(after, F.T)
    for i in range(states):
        for j in range(i):
            mean = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = mean
            P[j, i] = mean
        if not white:
            for j in range(states, F.shape[1]):
                P[i, j] = after[i, j]
                P[j, i] = after[i, j]


@njit(cache=True, nogil=True)
def whiten(A, B, Q, latent, node, H, D, variance, columns, follow):  # type: ignore[no-untyped-def]
    """Replace ``columns`` (m, c) by their normalised innovations; returns the sum of log standard deviations.

    node (m,): ascending node index of each row. H (m, X), D (m, w): response of the row to
    state (X = 12 and twice the internal coordinates) and noise. variance (m,): sensor noise of
    the row. Q (N or fewer, w, w): covariance of what is drawn at each node. latent (N, w): what the nominal
    motion already holds of this noise, whose mean is zero all the same; where it is not white, (N, l) of its
    first l components. follow (f, f): how each component's noise goes on, of
    no rows where all of it is white. Column 0 is measured less predicted, the others derivatives of the
    prediction.
    """
    rows, count = columns.shape
    states = A.shape[1]
    size = states + B.shape[2]
    P = np.zeros((size, size))
    X = np.zeros((size, count))
    gain = np.empty(size)
    h = np.empty(size)
    white = follow.shape[0] == 0
    log_sum = 0.0
    row = 0
    x_next = np.empty((states, count))
    F = np.empty((states, size))
    for k in range(A.shape[0]):
        _drawn(P, Q, follow, k)
        _expected(X, states, latent, follow, k)
        while row < rows and node[row] == k:
            for i in range(states):
                h[i] = H[row, i]
            for i in range(size - states):
                h[states + i] = D[row, i]
            spread = variance[row]
            for i in range(size):
                total = 0.0
                for j in range(size):
                    total += P[i, j] * h[j]
                gain[i] = total
            for i in range(size):
                spread += h[i] * gain[i]
            deviation = np.sqrt(spread)
            log_sum += np.log(deviation)
            # Row by row: each line of X lies together in memory
            for i in range(size):
                if h[i] != 0.0:
                    for c in range(count):
                        columns[row, c] -= h[i] * X[i, c]
            for c in range(count):
                columns[row, c] /= deviation
            for i in range(size):
                g = gain[i] / deviation
                for c in range(count):
                    X[i, c] += g * columns[row, c]
            for i in range(size):
                g = gain[i] / spread
                for j in range(size):
                    P[i, j] -= g * gain[j]
            row += 1
        F[:, :states] = A[k]
        F[:, states:] = B[k]
        x_next[:, :] = np.dot(F, X)
        for i in range(states):
            for c in range(count):
                X[i, c] = x_next[i, c]
        _moved_on(P, F, white)
    return log_sum


@njit(cache=True, nogil=True)
def filter_of(A, B, Q, node, H, D, variance, follow):  # type: ignore[no-untyped-def]
    """The filter of :func:`whiten` for columns to come.

    Returns (m, X + w) what an innovation of one standard deviation moves state and wrench by, and (m,) the
    standard deviations.
    """
    states = A.shape[1]
    size = states + B.shape[2]
    gains, deviations = np.zeros((node.shape[0], size)), np.empty(node.shape[0])
    white = follow.shape[0] == 0
    P = np.zeros((size, size))
    h, gain, F = np.empty(size), np.empty(size), np.empty((states, size))
    row = 0
    for k in range(A.shape[0]):
        _drawn(P, Q, follow, k)
        while row < node.shape[0] and node[row] == k:
            h[:states] = H[row]
            h[states:] = D[row]
            gain[:] = np.dot(P, h)
            spread = variance[row] + np.dot(h, gain)
            deviations[row] = np.sqrt(spread)
            for i in range(size):
                gains[row, i] = gain[i] / deviations[row]
                for j in range(size):
                    P[i, j] -= gain[i] * gain[j] / spread
            row += 1
        F[:, :states] = A[k]
        F[:, states:] = B[k]
        _moved_on(P, F, white)
    return gains, deviations


@njit(cache=True, nogil=True)
def smooth(A, B, Q, latent, node, H, D, variance, residual, start, follow):  # type: ignore[no-untyped-def]
    """Best correction of the nominal motion by noise that enters as force, given the whole run.

    Arguments as in :func:`whiten`; residual (m,) measured less predicted; start (X, X)
    covariance of the start state. Returns (N, X) state and (N, w) noise corrections, and
    (N, X, X) covariance of the filtered state (fixed-interval smoother by the adjoint
    recursion, which inverts no covariance: Durbin & Koopman, "Time Series Analysis by
    State Space Methods", 2012, section 4.4).
    """
    rows = residual.shape[0]
    nodes = A.shape[0]
    order = A.shape[1]
    size = order + B.shape[2]
    means = np.zeros((nodes, size))
    spreads = np.zeros((nodes, size, size))
    gains = np.zeros((rows, size))
    scaled = np.zeros(rows)
    filtered = np.zeros((nodes, order, order))
    white = follow.shape[0] == 0
    P = np.zeros((size, size))
    P[:order, :order] = start
    x = np.zeros(size)
    h = np.empty(size)
    F = np.empty((order, size))
    row = 0
    for k in range(nodes):
        _drawn(P, Q, follow, k)
        _expected(x.reshape(-1, 1), order, latent, follow, k)
        means[k] = x
        spreads[k] = P
        while row < rows and node[row] == k:
            h[:order] = H[row]
            h[order:] = D[row]
            Ph = np.dot(P, h)
            spread = variance[row] + np.dot(h, Ph)
            gains[row] = Ph / spread
            miss = residual[row] - np.dot(h, x)
            scaled[row] = miss / spread
            for i in range(size):
                x[i] += gains[row, i] * miss
                for j in range(size):
                    P[i, j] -= gains[row, i] * Ph[j]
            row += 1
        filtered[k] = P[:order, :order]
        F[:, :order] = A[k]
        F[:, order:] = B[k]
        x[:order] = np.dot(F, x)
        _moved_on(P, F, white)
    states = np.zeros((nodes, order))
    drawn = np.zeros((nodes, size - order))
    adjoint = np.zeros(size)
    row = rows - 1
    for k in range(nodes - 1, -1, -1):
        if k < nodes - 1:
            F[:, :order] = A[k]
            F[:, order:] = B[k]
            ahead = adjoint
            adjoint = np.dot(F.T, np.ascontiguousarray(ahead[:order]))
            if not white:
                # What later samples say of noise that goes on
                told = ahead[order:].copy().reshape(-1, 1)
                followed(told, follow.T)
                adjoint[order:] += told[:, 0]
        while row >= 0 and node[row] == k:
            h[:order] = H[row]
            h[order:] = D[row]
            weight = scaled[row] - np.dot(gains[row], adjoint)
            adjoint = adjoint + h * weight
            row -= 1
        best = means[k] + np.dot(spreads[k], adjoint)
        states[k] = best[:order]
        drawn[k] = best[order:]
    return states, drawn, filtered
