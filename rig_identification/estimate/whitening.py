"""Prediction errors of a motion that noise drives as force: one Kalman pass, any number of columns.

About the nominal motion, x_{k+1} = A_k x_k + B_k w_k with w_k ~ N(0, Q_k) white, and a grouped
sample at node k reads H x_k + D w_k + e. The filter's innovations, divided by their own
standard deviation, are white under the model (Kailath, IEEE TAC 13, 1968); what it does
to the residual it does to every column of the Jacobian, and least squares on the result
is generalised least squares with the exact covariance of force and sensor noise. The sum
of log standard deviations is what the marginal likelihood needs beside it.

Noise that is not white has w_k a mean of two draws of three numbers, w_k = (u_j, u_{j+1}) over ``each``
nodes, of which the second becomes the first when the next one is drawn (force_noise.py). ``each`` 1: all
six numbers are drawn anew at every node.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def _drawn(P, Q, k, each):  # type: ignore[no-untyped-def]
    """Write what node ``k`` draws, of covariance ``Q`` (6, 6), into ``P``: nothing is known of it yet."""
    states = P.shape[0] - 6
    new = states
    if each > 1 and k > 0:
        if k % each != 0:
            return
        # What was the second draw is the first one now
        new = states + 3
        for i in range(3):
            for j in range(states):
                P[states + i, j] = P[new + i, j]
                P[j, states + i] = P[new + i, j]
        for i in range(3):
            for j in range(3):
                P[states + i, states + j] = P[new + i, new + j]
    for i in range(new, states + 6):
        for j in range(new):
            P[i, j] = 0.0
            P[j, i] = 0.0
        for j in range(new, states + 6):
            P[i, j] = Q[i - states, j - states]


@njit(cache=True, nogil=True)
def _moved_on(P, F, each):  # type: ignore[no-untyped-def]
    """Carry ``P`` to the next node by ``F`` (X, X + 6), its state alone where all draws are over."""
    states = F.shape[0]
    after = np.dot(F, P)
    P[:states, :states] = np.dot(after, F.T)
    for i in range(states):
        for j in range(i):
            mean = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = mean
            P[j, i] = mean
        if each > 1:
            for j in range(states, states + 6):
                P[i, j] = after[i, j]
                P[j, i] = after[i, j]


@njit(cache=True, nogil=True)
def whiten(A, B, Q, latent, node, H, D, variance, columns, each=1):  # type: ignore[no-untyped-def]
    """Replace ``columns`` (m, c) by their normalised innovations; returns the sum of log standard deviations.

    node (m,): ascending node index of each row. H (m, X), D (m, 6): response of the row to
    state (X = 12 and twice the internal coordinates) and wrench. variance (m,): sensor noise of
    the row. Q (N, 6, 6): covariance of the wrench over each interval. latent (N, 6): wrench that the nominal
    motion already holds of this noise, whose mean is zero all the same. Column 0 is measured less predicted,
    the others derivatives of the prediction. each: nodes from draw to draw, 1 where ``latent`` is not zero.
    """
    rows, count = columns.shape
    states = A.shape[1]
    size = states + 6
    P = np.zeros((size, size))
    X = np.zeros((size, count))
    gain = np.empty(size)
    h = np.empty(size)
    log_sum = 0.0
    row = 0
    x_next = np.empty((states, count))
    F = np.empty((states, size))
    for k in range(A.shape[0]):
        _drawn(P, Q[k], k, each)
        if k % each == 0:
            for i in range(6):
                for c in range(count):
                    X[states + i, c] = X[states + i + 3, c] if each > 1 and i < 3 else 0.0
                X[states + i, 0] -= latent[k, i]
        while row < rows and node[row] == k:
            for i in range(states):
                h[i] = H[row, i]
            for i in range(6):
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
        _moved_on(P, F, each)
    return log_sum


@njit(cache=True, nogil=True)
def filter_of(A, B, Q, node, H, D, variance, each=1):  # type: ignore[no-untyped-def]
    """The filter of :func:`whiten` for columns to come.

    Returns (m, X + 6) what an innovation of one standard deviation moves state and wrench by, and (m,) the
    standard deviations.
    """
    states = A.shape[1]
    size = states + 6
    gains, deviations = np.zeros((node.shape[0], size)), np.empty(node.shape[0])
    P = np.zeros((size, size))
    h, gain, F = np.empty(size), np.empty(size), np.empty((states, size))
    row = 0
    for k in range(A.shape[0]):
        _drawn(P, Q[k], k, each)
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
        _moved_on(P, F, each)
    return gains, deviations


@njit(cache=True, nogil=True)
def smooth(A, B, Q, latent, node, H, D, variance, residual, start, each=1):  # type: ignore[no-untyped-def]
    """Best correction of the nominal motion by noise that enters as force, given the whole run.

    Arguments as in :func:`whiten`; residual (m,) measured less predicted; start (X, X)
    covariance of the start state. Returns (N, X) state and (N, 6) wrench corrections, and
    (N, X, X) covariance of the filtered state (fixed-interval smoother by the adjoint
    recursion, which inverts no covariance: Durbin & Koopman, "Time Series Analysis by
    State Space Methods", 2012, section 4.4).
    """
    rows = residual.shape[0]
    nodes = A.shape[0]
    order = A.shape[1]
    size = order + 6
    means = np.zeros((nodes, size))
    spreads = np.zeros((nodes, size, size))
    gains = np.zeros((rows, size))
    scaled = np.zeros(rows)
    filtered = np.zeros((nodes, order, order))
    P = np.zeros((size, size))
    P[:order, :order] = start
    x = np.zeros(size)
    h = np.empty(size)
    F = np.empty((order, size))
    row = 0
    for k in range(nodes):
        _drawn(P, Q[k], k, each)
        if k % each == 0:
            for i in range(6):
                x[order + i] = (x[order + i + 3] if each > 1 and i < 3 else 0.0) - latent[k, i]
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
        _moved_on(P, F, each)
    states = np.zeros((nodes, order))
    wrenches = np.zeros((nodes, 6))
    adjoint = np.zeros(size)
    row = rows - 1
    for k in range(nodes - 1, -1, -1):
        if k < nodes - 1:
            F[:, :order] = A[k]
            F[:, order:] = B[k]
            ahead = adjoint
            adjoint = np.dot(F.T, np.ascontiguousarray(ahead[:order]))
            # What later samples say of a draw that goes on
            if (k + 1) % each != 0:
                adjoint[order:] += ahead[order:]
            elif each > 1:
                adjoint[order + 3 :] += ahead[order : order + 3]
        while row >= 0 and node[row] == k:
            h[:order] = H[row]
            h[order:] = D[row]
            weight = scaled[row] - np.dot(gains[row], adjoint)
            adjoint = adjoint + h * weight
            row -= 1
        best = means[k] + np.dot(spreads[k], adjoint)
        states[k] = best[:order]
        wrenches[k] = best[order:]
    return states, wrenches, filtered
