"""Exact derivatives of a motion that is known: sensitivity columns along it, and what they do to the outputs.

About a motion x(t) a small change, the pose's as a right-hand rotation increment theta, obeys
    dp' = dv,  theta' = dw - w x theta,  dv' = R (dA + theta x A),  dw' = d alpha,
with dA and d alpha linear in the change, in a further wrench and in the entries p of ``physics``
(integrate.linearise), that is  X' = F(t) X + G(t). Over each line of an interval F and G are the parabola
through its two ends and its middle, and the columns follow it by Runge-Kutta of fourth order: with one
step a line that is the linearised step of integrate.propagate to third order in its length. Where a stiff
cable asks for many short steps, F and G, which change with the swing, need not be known at each of them.
At each node the columns go to the tangent of the cables' manifold (constraints.py). They are kept as
    x_{k+1} = A_k x_k + B_k w_k + C_k p
with w a wrench held over the interval, so that filters (noise that enters as force) and parameter
derivatives share one pass. Intervals know nothing of each other: they are worked on side by side.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.constraints import project_columns
from rig_identification.model.integrate import WRENCH, exciter_at, linearise, solve
from rig_identification.model.layout import (
    BODY_STATE,
    GRAVITY,
    OUT_ANGULAR_ACCELERATION,
    OUT_GRAVITY,
    OUT_POSITION,
    OUT_RATE,
    OUT_ROTATION,
    OUT_SPECIFIC_FORCE,
    OUT_TENSION,
    RATE,
    ROTATION,
    VELOCITY,
)


@njit(cache=True, nogil=True)
def _write_slopes(R, x, z, dz, cables, slopes):  # type: ignore[no-untyped-def]
    """slopes (X, X + 6 + d) = (F, G): dx/dt of a change of state, wrench and physics. R, x: with phi = 0."""
    states, local = slopes.shape
    internal = (states - BODY_STATE) // 2
    slopes[:, :] = 0.0
    w0, w1, w2 = x[RATE], x[RATE + 1], x[RATE + 2]
    for i in range(3):
        slopes[i, VELOCITY + i] = 1.0
        slopes[ROTATION + i, RATE + i] = 1.0
        a, b, c = R[i, 0], R[i, 1], R[i, 2]
        for k in range(local):
            slopes[VELOCITY + i, k] = a * dz[0, k] + b * dz[1, k] + c * dz[2, k]
            slopes[RATE + i, k] = dz[3 + i, k]
        # R (theta x A)
        slopes[VELOCITY + i, ROTATION] += c * z[1] - b * z[2]
        slopes[VELOCITY + i, ROTATION + 1] += a * z[2] - c * z[0]
        slopes[VELOCITY + i, ROTATION + 2] += b * z[0] - a * z[1]
    slopes[ROTATION, ROTATION + 1], slopes[ROTATION, ROTATION + 2] = w2, -w1
    slopes[ROTATION + 1, ROTATION], slopes[ROTATION + 1, ROTATION + 2] = -w2, w0
    slopes[ROTATION + 2, ROTATION], slopes[ROTATION + 2, ROTATION + 1] = w1, -w0
    for j in range(internal):
        slopes[BODY_STATE + j, BODY_STATE + internal + j] = 1.0
        for k in range(local):
            slopes[BODY_STATE + internal + j, k] = dz[6 + cables + j, k]


@njit(cache=True, nogil=True)
def _change(slopes, columns, out):  # type: ignore[no-untyped-def]
    """out (X, m) = F columns + (0, G)."""
    states, local = columns.shape
    for i in range(states):
        for c in range(states):
            out[i, c] = 0.0
        for c in range(states, local):
            out[i, c] = slopes[i, c]
        for d in range(states):
            f = slopes[i, d]
            if f != 0.0:
                for c in range(local):
                    out[i, c] += f * columns[d, c]


@njit(cache=True, nogil=True)
def _along(before, middle, after, at, out):  # type: ignore[no-untyped-def]
    """out: the parabola through three slopes at 0, 1/2 and 1."""
    first, second, third = (1.0 - at) * (1.0 - 2.0 * at), 4.0 * at * (1.0 - at), at * (2.0 * at - 1.0)
    for i in range(out.shape[0]):
        for c in range(out.shape[1]):
            out[i, c] = first * before[i, c] + second * middle[i, c] + third * after[i, c]


@njit(cache=True, nogil=True)
def _follow(before, middle, after, duration, steps, columns, work):  # type: ignore[no-untyped-def]
    """Columns at the end of a line. work (6, X, m): room for what is computed on the way."""
    states, local = columns.shape
    k, stage = work[0], work[1]
    total = work[2]
    h = duration / steps
    first, half, last = before, middle, after
    for step in range(steps):
        if steps > 1:
            _along(before, middle, after, step / steps, work[3])
            _along(before, middle, after, (step + 0.5) / steps, work[4])
            _along(before, middle, after, (step + 1.0) / steps, work[5])
            first, half, last = work[3], work[4], work[5]
        _change(first, columns, k)
        for i in range(states):
            for c in range(local):
                total[i, c] = k[i, c]
                stage[i, c] = columns[i, c] + 0.5 * h * k[i, c]
        _change(half, stage, k)
        for i in range(states):
            for c in range(local):
                total[i, c] += 2.0 * k[i, c]
                stage[i, c] = columns[i, c] + 0.5 * h * k[i, c]
        _change(half, stage, k)
        for i in range(states):
            for c in range(local):
                total[i, c] += 2.0 * k[i, c]
                stage[i, c] = columns[i, c] + h * k[i, c]
        _change(last, stage, k)
        for i in range(states):
            for c in range(local):
                columns[i, c] += h / 6.0 * (total[i, c] + k[i, c])


@njit(cache=True, nogil=True)
def _write_output_columns(physics, states, R, dz, directions, out):  # type: ignore[no-untyped-def]
    """out (OUT_TENSION + n, states + 6 + d): derivative of raw outputs in state, wrench, physics."""
    n = out.shape[0] - OUT_TENSION
    m = dz.shape[1]
    for i in range(OUT_TENSION):
        for c in range(m):
            out[i, c] = 0.0
    g = np.zeros(3)
    for i in range(3):
        for j in range(3):
            g[i] += R[j, i] * physics[GRAVITY + j]
    for i in range(3):
        out[OUT_POSITION + i, i] = 1.0
        out[OUT_ROTATION + i, ROTATION + i] = 1.0
        out[OUT_RATE + i, RATE + i] = 1.0
        for c in range(m):
            out[OUT_SPECIFIC_FORCE + i, c] = dz[i, c]
            out[OUT_ANGULAR_ACCELERATION + i, c] = dz[3 + i, c]
    # d(R^T g) = (R^T g) x dtheta + R^T dg
    out[OUT_GRAVITY, ROTATION + 1] = -g[2]
    out[OUT_GRAVITY, ROTATION + 2] = g[1]
    out[OUT_GRAVITY + 1, ROTATION] = g[2]
    out[OUT_GRAVITY + 1, ROTATION + 2] = -g[0]
    out[OUT_GRAVITY + 2, ROTATION] = -g[1]
    out[OUT_GRAVITY + 2, ROTATION + 1] = g[0]
    for k in range(directions.shape[0]):
        d = directions[k]
        if GRAVITY <= d < GRAVITY + 3:
            for i in range(3):
                out[OUT_GRAVITY + i, states + WRENCH + k] = R[d - GRAVITY, i]
    for i in range(3):
        for c in range(m):
            out[OUT_SPECIFIC_FORCE + i, c] -= out[OUT_GRAVITY + i, c]
    for i in range(n):
        for c in range(m):
            out[OUT_TENSION + i, c] = dz[6 + i, c]


@njit(cache=True, nogil=True)
def vary(  # type: ignore[no-untyped-def]
    physics,
    mount,
    forces,
    force_rates,
    force_middles,
    wrenches,
    step,
    substeps,
    directions,
    line_x,
    line_R,
    line_modes,
    first_node,
    end_node,
    starts,
    A,
    B,
    C,
    H,
    D,
    J,
):
    """Derivatives over the intervals and at the nodes from ``first_node`` to before ``end_node``.

    physics to directions: as in integrate.propagate, whose ``line_*`` tell of the motion. Filled: A, B, H, D
    (see motion.Motion), C (N, X, d), and of J (N, OUT_TENSION + n, starts + d) what physics does to the
    outputs at once; :func:`chain` adds what it does by way of the state. Returns False where the rig is
    singular.
    """
    nodes, points, states = line_x.shape
    n = line_modes.shape[2]
    internal = (states - BODY_STATE) // 2
    size = 6 + n + internal
    local = states + WRENCH + directions.shape[0]
    lines = points // 2
    K, r, inverse, z = np.empty((size, size)), np.empty(size), np.empty((size, size)), np.empty(size)
    dz = np.empty((size, local))
    slopes = np.empty((3, states, local))
    before, middle, after = 0, 1, 2
    columns, work = np.empty((states, local)), np.empty((6, states, local))
    out_columns = np.empty((OUT_TENSION + n, local))
    force, rate = np.empty(3), np.empty(3)
    known = False
    for node in range(first_node, end_node):
        last = node == nodes - 1
        x, R, modes = line_x[node, 0], line_R[node, 0], line_modes[node, 0]
        if not known:
            exciter_at(forces, force_rates, force_middles, node, 0.0, force, rate)
            if not solve(physics, modes, mount, x, R, force, wrenches[node], K, r, inverse, z):
                return False
            linearise(physics, modes, mount, R, x, force, rate, z, inverse, directions, dz)
            _write_slopes(R, x, z, dz, n, slopes[before])
        _write_output_columns(physics, states, R, dz, directions, out_columns)
        H[node] = out_columns[:, :states]
        D[node] = out_columns[:, states : states + WRENCH]
        J[node, :, starts:] = out_columns[:, states + WRENCH :]
        if last:
            break
        columns[:, :] = 0.0
        for i in range(states):
            columns[i, i] = 1.0
        for line in range(lines):
            for point in range(1, 3):
                # The end of the last line is the next node, as this interval sees it
                beyond = line == lines - 1 and point == 2
                at = node + 1 if beyond else node
                place = 0 if beyond else 2 * line + point
                now = line_modes[node, points - 1] if beyond else line_modes[node, place]
                exciter_at(
                    forces, force_rates, force_middles, node, (line + 0.5 * point) / lines, force, rate
                )
                x, R = line_x[at, place], line_R[at, place]
                if not solve(physics, now, mount, x, R, force, wrenches[node], K, r, inverse, z):
                    return False
                linearise(physics, now, mount, R, x, force, rate, z, inverse, directions, dz)
                _write_slopes(R, x, z, dz, n, slopes[middle if point == 1 else after])
            _follow(
                slopes[before],
                slopes[middle],
                slopes[after],
                step / lines,
                max(1, substeps // lines),
                columns,
                work,
            )
            before, after = after, before
        project_columns(
            physics,
            line_modes[node, points - 1],
            line_x[node + 1, 0],
            line_R[node + 1, 0],
            directions,
            states + WRENCH,
            columns,
        )
        A[node] = columns[:, :states]
        B[node] = columns[:, states : states + WRENCH]
        C[node] = columns[:, states + WRENCH :]
        # The next interval begins where this one ends, unless another wrench acts in it or a cable switches
        known = True
        for i in range(WRENCH):
            known = known and wrenches[node + 1, i] == wrenches[node, i]
        for i in range(n):
            known = known and line_modes[node + 1, 0, i] == line_modes[node, points - 1, i]
    return True


@njit(cache=True, nogil=True)
def chain(A, C, H, start_columns, starts, J):  # type: ignore[no-untyped-def]
    """Add to J (N, OUT_TENSION + n, starts + d) what start and physics do to the outputs by way of the state.

    start_columns (X, starts + d): derivative of the start state.
    """
    S = start_columns.copy()
    for node in range(A.shape[0]):
        J[node] += np.dot(H[node], S)
        if node < A.shape[0] - 1:
            S = np.dot(A[node], S)
            S[:, starts:] += C[node]
