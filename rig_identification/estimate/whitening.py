"""Prediction errors of a motion that noise drives as force: one Kalman pass, any number of columns.

About the nominal motion, x_{k+1} = A_k x_k + B_k w_k with w_k ~ N(0, Q_k) white, and a grouped
sample at node k reads H x_k + D w_k + e. The filter's innovations, divided by their own
standard deviation, are white under the model (Kailath, IEEE TAC 13, 1968); what it does
to the residual it does to every column of the Jacobian, and least squares on the result
is generalised least squares with the exact covariance of force and sensor noise. The sum
of log standard deviations is what the marginal likelihood needs beside it.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def _new_wrench(P, Q):  # type: ignore[no-untyped-def]
    """Write a new interval's wrench, of covariance ``Q`` (6, 6), into ``P``: nothing is known of it yet."""
    states = P.shape[0] - 6
    for i in range(6):
        for j in range(6):
            P[states + i, states + j] = Q[i, j]
        for j in range(states):
            P[states + i, j] = 0.0
            P[j, states + i] = 0.0


@njit(cache=True, nogil=True)
def whiten(A, B, Q, latent, node, H, D, variance, columns):  # type: ignore[no-untyped-def]
    """Replace ``columns`` (m, c) by their normalised innovations; returns the sum of log standard deviations.

    node (m,): ascending node index of each row. H (m, X), D (m, 6): response of the row to
    state (X = 12 and twice the internal coordinates) and wrench. variance (m,): sensor noise of
    the row. Q (N, 6, 6): covariance of the wrench over each interval. latent (N, 6):
    wrench that the nominal motion already holds of
    this noise, whose mean is zero all the same. Column 0 is measured less predicted, the others derivatives
    of the prediction.
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
    P_next = np.empty((states, states))
    F = np.empty((states, size))
    for k in range(A.shape[0]):
        _new_wrench(P, Q[k])
        for i in range(6):
            for c in range(count):
                X[states + i, c] = 0.0
            X[states + i, 0] = -latent[k, i]
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
        P_next[:, :] = np.dot(np.dot(F, P), F.T)
        for i in range(states):
            for c in range(count):
                X[i, c] = x_next[i, c]
            for j in range(states):
                P[i, j] = 0.5 * (P_next[i, j] + P_next[j, i])
    return log_sum


@njit(cache=True, nogil=True)
def filter_of(A, B, Q, node, H, D, variance):  # type: ignore[no-untyped-def]
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
        _new_wrench(P, Q[k])
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
        after = np.dot(np.dot(F, P), F.T)
        P[:states, :states] = 0.5 * (after + after.T)
    return gains, deviations


@njit(cache=True, nogil=True)
def smooth(A, B, Q, latent, node, H, D, variance, residual, start):  # type: ignore[no-untyped-def]
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
        _new_wrench(P, Q[k])
        for i in range(6):
            x[order + i] = -latent[k, i]
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
        x_next = np.dot(F, x)
        P_next = np.dot(np.dot(F, P), F.T)
        x[:order] = x_next
        for i in range(order):
            for j in range(order):
                P[i, j] = 0.5 * (P_next[i, j] + P_next[j, i])
    states = np.zeros((nodes, order))
    wrenches = np.zeros((nodes, 6))
    adjoint = np.zeros(size)
    row = rows - 1
    for k in range(nodes - 1, -1, -1):
        if k < nodes - 1:
            F[:, :order] = A[k]
            F[:, order:] = B[k]
            adjoint = np.dot(F.T, np.ascontiguousarray(adjoint[:order]))
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
