"""Motion and its exact derivatives: Runge-Kutta of fourth order on the rotation group.

Each step integrates the local state of dynamics.py from a fresh reference rotation
(Munthe-Kaas, "High order Runge-Kutta methods on manifolds", 1999), goes back to the cable
lengths, and carries sensitivity columns through the same four stages. Columns are kept
per node interval as
    x_{k+1} = A_k x_k + B_k w_k + C_k p        (first-order, about the motion)
with w a wrench held over the interval and p the chosen entries of ``physics``, so that
filters (noise that enters as force) and parameter derivatives share one pass.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.arithmetic import STEP, eliminate, invert
from rig_identification.model.constraints import (
    cable_length_and_rate,
    project_columns,
    project_state,
    update_reference,
)
from rig_identification.model.dynamics import (
    add_cable,
    assemble,
    rotation,
    rotation_rate,
)
from rig_identification.model.effects.all import (
    add_effects,
    add_effects_at,
    effects_follow,
    effects_reach,
    in_cable_rows,
)
from rig_identification.model.effects.cable_mass import weight_below_cell
from rig_identification.model.effects.internal import ceiling_shift
from rig_identification.model.effects.place import LINEAR_DENSITY
from rig_identification.model.layout import (
    BODY_STATE,
    CABLE_SIZE,
    CABLES,
    EXCITER_POSITION,
    GRAVITY,
    HINGE_DAMPING,
    INERTIAL,
    LENGTH,
    OUT_ANGULAR_ACCELERATION,
    OUT_GRAVITY,
    OUT_POSITION,
    OUT_RATE,
    OUT_ROTATION,
    OUT_SPECIFIC_FORCE,
    OUT_TENSION,
    RATE,
    RIGID,
    ROTATION,
    SLACK,
    VELOCITY,
)
from rig_identification.model.number_columns import (
    add_body_number,
    add_exciter_number,
    cable_number_columns,
)
from rig_identification.model.state_columns import body_and_cable_columns

EXCITER_CLOCK = -1  # direction: the exciter's stamps are late by this (s)
WRENCH = 6


@njit(cache=True, nogil=True)
def solve(physics, modes, mount, x, R, force, wrench, K, r, inverse, z):  # type: ignore[no-untyped-def]
    """z = K^-1 r; False where the rig is singular. ``inverse`` keeps K^-1 where it has room for it."""
    assemble(physics, modes, mount, x, R, force, wrench, K, r)
    if inverse.shape[0] == 0:
        z[:] = r
        return eliminate(K, z)
    if not invert(K, inverse):
        return False
    size = r.shape[0]
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += inverse[i, j] * r[j]
        z[i] = total
    return True


@njit(cache=True, nogil=True)
def _add_defect(K, r, z, change):  # type: ignore[no-untyped-def]
    """change += derivative of r - K z, carried by the imaginary parts of K and r."""
    for i in range(z.shape[0]):
        total = r[i].imag
        for j in range(z.shape[0]):
            total -= K[i, j].imag * z[j]
        change[i] += total / STEP


@njit(cache=True, nogil=True)
def linearise(physics, modes, mount, reference, x, force, force_rate, z, inverse, directions, out):  # type: ignore[no-untyped-def]
    """out (6 + n + s, 12 + 2 s + 6 + len(directions)) = dz in state, wrench and physics.

    What every rig has is written out (state_columns.py, number_columns.py); effects carry their derivative in
    the imaginary part.
    """
    size, states, n = z.shape[0], x.shape[0], modes.shape[0]
    xc = x.astype(np.complex128)
    pc = physics.astype(np.complex128)
    R = np.empty((3, 3))
    Rc = np.empty((3, 3), dtype=np.complex128)
    Kc = np.empty((size, size), dtype=np.complex128)
    rc = np.empty(size, dtype=np.complex128)
    own = np.empty((9, size))
    block = CABLES + CABLE_SIZE * n
    weighty = physics.shape[0] > block and physics[block + LINEAR_DENSITY] != 0.0
    internal = (states - BODY_STATE) // 2
    air, heavy, rotor, hinged = effects_reach(physics, modes, internal)
    follow_place, follow_turn = effects_follow(physics, modes, internal)
    defect = np.zeros((size, states + directions.shape[0]))
    weight = np.zeros((n, states + directions.shape[0]))  # of the cables themselves, at their cells
    rotation(reference, x, R)
    body_and_cable_columns(physics, modes, x, R, z, defect[:, :states])
    for column in range(states):
        moved = column < ROTATION or VELOCITY <= column < RATE
        if column < BODY_STATE and not (follow_place if moved else follow_turn):
            continue
        xc[column] = complex(x[column], STEP)
        rotation(reference, xc, Rc)
        Kc[:, :] = 0.0
        rc[:] = 0.0
        add_effects(pc, modes, xc, Rc, Kc, rc)
        _add_defect(Kc, rc, z, defect[:, column])
        if weighty:
            for i in range(n):
                weight[i, column] = weight_below_cell(pc, block, modes, i, xc, Rc).imag / STEP
        xc[column] = x[column]
    rotation(reference, xc, Rc)
    known = -1
    for column in range(directions.shape[0]):
        d = directions[column]
        change = defect[:, states + column]
        reached = True
        cable = -1
        if d == EXCITER_CLOCK or EXCITER_POSITION <= d < CABLES:
            add_exciter_number(physics, mount, d, force, force_rate, change)
            reached = rotor and d != EXCITER_CLOCK
        elif d < CABLES:
            add_body_number(physics, d, x, R, z, change)
            reached = heavy if d < INERTIAL else air
        elif d < block:
            cable = (d - CABLES) // CABLE_SIZE
            if cable != known:
                cable_number_columns(physics, modes, cable, x, R, z, own)
                known = cable
            number = (d - CABLES) % CABLE_SIZE
            if number < own.shape[0]:
                change[:] = own[number]
            reached = hinged or number >= HINGE_DAMPING
        if not reached:
            continue
        pc[d] = complex(physics[d], STEP)
        Kc[:, :] = 0.0
        rc[:] = 0.0
        if cable >= 0:
            add_effects_at(pc, modes, cable, xc, Rc, Kc, rc)
        else:
            if in_cable_rows(physics, modes, d):
                # A ceiling's numbers and the softness of redundant cables
                for i in range(n):
                    add_cable(pc, i, modes, xc, Rc, Kc, rc)
            add_effects(pc, modes, xc, Rc, Kc, rc)
        _add_defect(Kc, rc, z, change)
        if weighty or d == block + LINEAR_DENSITY:
            for i in range(n):
                if cable < 0 or i == cable:
                    weight[i, states + column] = weight_below_cell(pc, block, modes, i, xc, Rc).imag / STEP
        pc[d] = physics[d]
    out[:, :] = 0.0
    for i in range(size):
        for j in range(size):
            g = inverse[i, j]
            if g != 0.0:
                for c in range(states):
                    out[i, c] += g * defect[j, c]
                for c in range(states, defect.shape[1]):
                    out[i, c + WRENCH] += g * defect[j, c]
        for j in range(WRENCH):
            out[i, states + j] = inverse[i, j]
    for i in range(n):
        for c in range(weight.shape[1]):
            out[6 + i, c if c < states else c + WRENCH] += weight[i, c]


@njit(cache=True, nogil=True)
def _stage_columns(x, R, z, dz, columns, slopes):  # type: ignore[no-untyped-def]
    """slopes (12 + 2 s, m) = d(dx/dt) for stage columns (12 + 2 s, m): state, wrench, physics blocks."""
    m = columns.shape[1]
    states = x.shape[0]
    internal = (states - BODY_STATE) // 2
    behind = z.shape[0] - internal - 6
    # z responds to the state through dz's first columns, and directly to wrench and physics
    for c in range(m):
        for i in range(3):
            slopes[i, c] = columns[VELOCITY + i, c]
    response = np.zeros((6 + internal, m))
    for i in range(6 + internal):
        row = i if i < 6 else i + behind
        for d in range(states):
            g = dz[row, d]
            if g != 0.0:
                for c in range(m):
                    response[i, c] += g * columns[d, c]
        for c in range(states, m):
            response[i, c] += dz[row, c]
    for j in range(internal):
        for c in range(m):
            slopes[BODY_STATE + j, c] = columns[BODY_STATE + internal + j, c]
            slopes[BODY_STATE + internal + j, c] = response[6 + j, c]
    # dv/dt = R A: change of A, and of R: R (dtheta x A), dtheta = J_r(phi) dphi ~ dphi - phi x dphi / 2
    p0, p1, p2 = x[ROTATION], x[ROTATION + 1], x[ROTATION + 2]
    w0, w1, w2 = x[RATE], x[RATE + 1], x[RATE + 2]
    t = p0 * p0 + p1 * p1 + p2 * p2
    c2 = 0.5 - t / 24.0
    c3 = 1.0 / 6.0 - t / 120.0
    k = 1.0 / 12.0 + t / 720.0
    for c in range(m):
        f0, f1, f2 = columns[ROTATION, c], columns[ROTATION + 1, c], columns[ROTATION + 2, c]
        q0 = p1 * f2 - p2 * f1
        q1 = p2 * f0 - p0 * f2
        q2 = p0 * f1 - p1 * f0
        t0 = f0 - c2 * q0 + c3 * (p1 * q2 - p2 * q1)
        t1 = f1 - c2 * q1 + c3 * (p2 * q0 - p0 * q2)
        t2 = f2 - c2 * q2 + c3 * (p0 * q1 - p1 * q0)
        r0 = response[0, c] + t1 * z[2] - t2 * z[1]
        r1 = response[1, c] + t2 * z[0] - t0 * z[2]
        r2 = response[2, c] + t0 * z[1] - t1 * z[0]
        for i in range(3):
            slopes[VELOCITY + i, c] = R[i, 0] * r0 + R[i, 1] * r1 + R[i, 2] * r2
            slopes[RATE + i, c] = response[3 + i, c]
        # dphi/dt = w + phi x w / 2 + k phi x (phi x w)
        g0, g1, g2 = columns[RATE, c], columns[RATE + 1, c], columns[RATE + 2, c]
        s0 = p1 * w2 - p2 * w1
        s1 = p2 * w0 - p0 * w2
        s2 = p0 * w1 - p1 * w0
        d0 = f1 * w2 - f2 * w1 + p1 * g2 - p2 * g1
        d1 = f2 * w0 - f0 * w2 + p2 * g0 - p0 * g2
        d2 = f0 * w1 - f1 * w0 + p0 * g1 - p1 * g0
        dk = (p0 * f0 + p1 * f1 + p2 * f2) / 360.0
        slopes[ROTATION, c] = (
            g0 + 0.5 * d0 + k * (f1 * s2 - f2 * s1 + p1 * d2 - p2 * d1) + dk * (p1 * s2 - p2 * s1)
        )
        slopes[ROTATION + 1, c] = (
            g1 + 0.5 * d1 + k * (f2 * s0 - f0 * s2 + p2 * d0 - p0 * d2) + dk * (p2 * s0 - p0 * s2)
        )
        slopes[ROTATION + 2, c] = (
            g2 + 0.5 * d2 + k * (f0 * s1 - f1 * s0 + p0 * d1 - p1 * d0) + dk * (p0 * s1 - p1 * s0)
        )


@njit(cache=True, nogil=True)
def _absorb_rotation_columns(x, columns):  # type: ignore[no-untyped-def]
    """Turn columns of phi into columns of the right rotation increment of R_ref Exp(phi)."""
    p0, p1, p2 = x[ROTATION], x[ROTATION + 1], x[ROTATION + 2]
    t = p0 * p0 + p1 * p1 + p2 * p2
    c2 = 0.5 - t / 24.0
    c3 = 1.0 / 6.0 - t / 120.0
    for c in range(columns.shape[1]):
        f0, f1, f2 = columns[ROTATION, c], columns[ROTATION + 1, c], columns[ROTATION + 2, c]
        q0 = p1 * f2 - p2 * f1
        q1 = p2 * f0 - p0 * f2
        q2 = p0 * f1 - p1 * f0
        columns[ROTATION, c] = f0 - c2 * q0 + c3 * (p1 * q2 - p2 * q1)
        columns[ROTATION + 1, c] = f1 - c2 * q1 + c3 * (p2 * q0 - p0 * q2)
        columns[ROTATION + 2, c] = f2 - c2 * q2 + c3 * (p0 * q1 - p1 * q0)


@njit(cache=True, nogil=True)
def _write_outputs(physics, modes, R, x, z, out):  # type: ignore[no-untyped-def]
    n = modes.shape[0]
    block = CABLES + CABLE_SIZE * n
    for i in range(3):
        out[OUT_POSITION + i] = x[i]
        out[OUT_ROTATION + i] = 0.0
        out[OUT_RATE + i] = x[RATE + i]
        out[OUT_ANGULAR_ACCELERATION + i] = z[3 + i]
        weight = 0.0
        for j in range(3):
            weight += R[j, i] * physics[GRAVITY + j]
        out[OUT_SPECIFIC_FORCE + i] = z[i] - weight
        out[OUT_GRAVITY + i] = weight
    for i in range(n):
        out[OUT_TENSION + i] = z[6 + i]
        if physics.shape[0] > block:
            out[OUT_TENSION + i] += weight_below_cell(physics, block, modes, i, x, R)


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
def _switch_cables(physics, modes, x, reference, z, can_slacken):  # type: ignore[no-untyped-def]
    """Let go cables that would push, catch those that came tight; returns True on a change."""
    changed = False
    for i in range(modes.shape[0]):
        if not can_slacken[i]:
            continue
        if modes[i] == RIGID and z[6 + i] < 0.0:
            modes[i] = SLACK
            changed = True
        elif modes[i] == SLACK:
            o = CABLES + CABLE_SIZE * i
            gradient = np.empty(6)
            shift = ceiling_shift(physics, modes.shape[0], x, i)
            length, rate = cable_length_and_rate(physics, o, shift, x, reference, gradient)
            if length > physics[o + LENGTH] and rate > 0.0:
                modes[i] = RIGID
                changed = True
    return changed


@njit(cache=True, nogil=True)
def propagate(  # type: ignore[no-untyped-def]
    physics,
    modes,
    can_slacken,
    mount,
    x,
    reference,
    forces,
    force_rates,
    force_middles,
    wrenches,
    step,
    substeps,
    directions,
    sensitivity,
    alike,
    first,
    end,
    nodes_x,
    nodes_R,
    nodes_out,
    A,
    B,
    C,
    H,
    D,
    P,
):
    """Integrate from node ``first`` to ``end`` of N, ``step`` s apart; returns nodes done (``end``: all).

    x (12 + 2 s,), reference (3, 3) and modes (n,): at node ``first``, and left as they are at ``end`` (N: the
    last node's); s: internal coordinates. What is written of a node depends on nothing before it but these
    three: stretches can be done side by side, and come out bit for bit as in one go, if what is passed over
    without derivatives is done ``alike``: solved the way that derivatives ask for.
    forces, force_rates (N, 3): exciter force in its frame and its rate at the nodes, linear between;
    force_middles (N, 3): what the force has midway to the next node beyond that line (a parabola).
    wrenches (N, 6): further wrench,
    body axes, held over the interval. directions (d,): entries of ``physics`` to
    differentiate in (EXCITER_CLOCK: clock).
    Filled: nodes_x (N, X), nodes_R (N, 3, 3), nodes_out (N, OUT_TENSION + n), X = 12 + 2 s; and where
    ``sensitivity``: A (N, X, X), B (N, X, 6), C (N, X, d), and the outputs' derivatives in state, wrench and
    directions at their node, H (N, OUT_TENSION + n, X), D (N, OUT_TENSION + n, 6), P (N, OUT_TENSION + n, d).
    """
    nodes = forces.shape[0]
    n = modes.shape[0]
    states = x.shape[0]
    internal = (states - BODY_STATE) // 2
    size = 6 + n + internal
    d = directions.shape[0]
    local = states + WRENCH + d
    K = np.empty((size, size))
    r = np.empty(size)
    inverse = np.empty((size if sensitivity or alike else 0, size))
    z = np.empty(size)
    R = np.empty((3, 3))
    k = np.empty((4, states))
    y = np.empty(states)
    phi_rate = np.empty(3)
    force = np.empty(3)
    rate = np.empty(3)
    h = step / substeps
    weights = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
    ahead = np.array([0.0, 0.5, 0.5, 1.0])
    dz = np.empty((size, local if sensitivity else 0))
    columns = np.zeros((states, local if sensitivity else 0))
    stage = np.zeros((states, local if sensitivity else 0))
    slopes = np.empty((4, states, local if sensitivity else 0))
    out_columns = np.empty((OUT_TENSION + n, local if sensitivity else 0))
    for node in range(first, end):
        last = node == nodes - 1
        wrench = wrenches[node]
        if sensitivity:
            columns[:, :] = 0.0
            for i in range(states):
                columns[i, i] = 1.0
        for sub in range(1 if last else substeps):
            for s in range(4):
                for i in range(states):
                    y[i] = x[i] + (h * ahead[s] * k[s - 1, i] if s > 0 else 0.0)
                at = (sub + ahead[s]) / substeps
                for i in range(3):
                    after = forces[node, i] if last else forces[node + 1, i]
                    force[i] = forces[node, i] + at * (after - forces[node, i])
                    force[i] += 4.0 * at * (1.0 - at) * force_middles[node, i]
                    rate_after = force_rates[node, i] if last else force_rates[node + 1, i]
                    rate[i] = force_rates[node, i] + at * (rate_after - force_rates[node, i])
                rotation(reference, y, R)
                if not solve(physics, modes, mount, y, R, force, wrench, K, r, inverse, z):
                    return node
                if s == 0 and _switch_cables(physics, modes, y, reference, z, can_slacken):
                    project_state(physics, modes, x, reference)
                    y[:] = x
                    rotation(reference, y, R)
                    if not solve(physics, modes, mount, y, R, force, wrench, K, r, inverse, z):
                        return node
                if sensitivity:
                    linearise(physics, modes, mount, reference, y, force, rate, z, inverse, directions, dz)
                if s == 0 and sub == 0:
                    nodes_x[node] = y
                    nodes_R[node] = R
                    _write_outputs(physics, modes, R, y, z, nodes_out[node])
                    if sensitivity:
                        _write_output_columns(physics, states, R, dz, directions, out_columns)
                        H[node] = out_columns[:, :states]
                        D[node] = out_columns[:, states : states + WRENCH]
                        P[node] = out_columns[:, states + WRENCH :]
                    if last:
                        return nodes
                rotation_rate(y, phi_rate)
                for i in range(3):
                    k[s, i] = y[VELOCITY + i]
                    k[s, ROTATION + i] = phi_rate[i]
                    k[s, VELOCITY + i] = R[i, 0] * z[0] + R[i, 1] * z[1] + R[i, 2] * z[2]
                    k[s, RATE + i] = z[3 + i]
                for i in range(internal):
                    k[s, BODY_STATE + i] = y[BODY_STATE + internal + i]
                    k[s, BODY_STATE + internal + i] = z[6 + n + i]
                if sensitivity:
                    if s == 0:
                        stage[:, :] = columns
                    else:
                        for i in range(states):
                            for c in range(local):
                                stage[i, c] = columns[i, c] + h * ahead[s] * slopes[s - 1, i, c]
                    _stage_columns(y, R, z, dz, stage, slopes[s])
            for i in range(states):
                total_rate = 0.0
                for s in range(4):
                    total_rate += weights[s] * k[s, i]
                x[i] += h * total_rate
                if not abs(x[i]) < 1e6:
                    return node
            if sensitivity:
                for s in range(4):
                    for i in range(states):
                        for c in range(local):
                            columns[i, c] += h * weights[s] * slopes[s, i, c]
                _absorb_rotation_columns(x, columns)
            update_reference(reference, x)
            project_state(physics, modes, x, reference)
            if sensitivity:
                project_columns(physics, modes, x, reference, directions, states + WRENCH, columns)
        if sensitivity:
            A[node] = columns[:, :states]
            B[node] = columns[:, states : states + WRENCH]
            C[node] = columns[:, states + WRENCH :]
    return end


@njit(cache=True, nogil=True)
def accumulate(start_columns, A, C, H, P):  # type: ignore[no-untyped-def]
    """J (N, OUT_TENSION + n, b + d): total derivatives of the raw outputs at the nodes.

    start_columns (X, b + d): derivative of the start state in b start coordinates and the d directions.
    A, C, H, P: see :func:`propagate`.
    """
    nodes, outputs, d = P.shape
    starts = start_columns.shape[1] - d
    J = np.empty((nodes, outputs, starts + d))
    S = start_columns.copy()
    for node in range(nodes):
        J[node] = np.dot(H[node], S)
        J[node, :, starts:] += P[node]
        S = np.dot(A[node], S)
        S[:, starts:] += C[node]
    return J
