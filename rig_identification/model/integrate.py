"""Motion: Runge-Kutta of fourth order on the rotation group; and how its accelerations change.

Each step integrates the local state of dynamics.py from a fresh reference rotation
(Munthe-Kaas, "High order Runge-Kutta methods on manifolds", 1999) and goes back to the cable
lengths. What a change of state, wrench or ``physics`` does to the motion: variation.py.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.arithmetic import STEP, eliminate, invert
from rig_identification.model.constraints import (
    cable_length_and_rate,
    project_state,
    update_reference,
)
from rig_identification.model.dynamics import (
    add_cable,
    assemble,
    rotation,
    rotation_rate,
)
from rig_identification.model.effects.all import add_effects, effects_act, effects_reach
from rig_identification.model.effects.cable_mass import weight_below_cell
from rig_identification.model.effects.internal import ceiling_shift
from rig_identification.model.effects.place import LINEAR_DENSITY
from rig_identification.model.layout import (
    BODY_STATE,
    CABLE_SIZE,
    CABLES,
    EXCITER_POSITION,
    GRAVITY,
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
    own, change = np.empty((9, size)), np.empty(size)
    block = CABLES + CABLE_SIZE * n
    weighty = physics.shape[0] > block and physics[block + LINEAR_DENSITY] != 0.0
    internal = (states - BODY_STATE) // 2
    air, heavy, rotor, hinged = effects_reach(physics, modes, internal)
    acting = internal > 0 or effects_act(physics, modes)
    defect = np.zeros((size, states + directions.shape[0]))
    rotation(reference, x, R)
    body_and_cable_columns(physics, modes, x, R, z, defect[:, :states])
    if acting:
        for column in range(states):
            xc[column] = complex(x[column], STEP)
            rotation(reference, xc, Rc)
            Kc[:, :] = 0.0
            rc[:] = 0.0
            add_effects(pc, modes, xc, Rc, Kc, rc)
            _add_defect(Kc, rc, z, defect[:, column])
            xc[column] = x[column]
    rotation(reference, xc, Rc)
    known = -1
    for column in range(directions.shape[0]):
        d = directions[column]
        change[:] = 0.0
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
            reached = hinged
        else:
            # A ceiling's numbers and the softness of redundant cables stand in all cables' rows
            pc[d] = complex(physics[d], STEP)
            Kc[:, :] = 0.0
            rc[:] = 0.0
            for i in range(n):
                add_cable(pc, i, modes, xc, Rc, Kc, rc)
            _add_defect(Kc, rc, z, change)
            reached = True
        if reached:
            pc[d] = complex(physics[d], STEP)
            Kc[:, :] = 0.0
            rc[:] = 0.0
            add_effects(pc, modes, xc, Rc, Kc, rc)
            _add_defect(Kc, rc, z, change)
        if d >= 0:
            pc[d] = physics[d]
        for i in range(size):
            defect[i, states + column] = change[i]
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
    for column in range(states + directions.shape[0]):
        heavier = column >= states and directions[column - states] == block + LINEAR_DENSITY
        if not weighty and not heavier:
            continue
        target = column if column < states else column + WRENCH
        if column < states:
            xc[column] = complex(x[column], STEP)
            rotation(reference, xc, Rc)
        elif directions[column - states] >= 0:
            rotation(reference, xc, Rc)
            pc[directions[column - states]] = complex(physics[directions[column - states]], STEP)
        for i in range(n):
            out[6 + i, target] += weight_below_cell(pc, block, modes, i, xc, Rc).imag / STEP
        if column < states:
            xc[column] = x[column]
        elif directions[column - states] >= 0:
            pc[directions[column - states]] = physics[directions[column - states]]


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
            shift = ceiling_shift(physics, modes.shape[0], x)
            length, rate = cable_length_and_rate(physics, o, shift, x, reference, gradient)
            if length > physics[o + LENGTH] and rate > 0.0:
                modes[i] = RIGID
                changed = True
    return changed


@njit(cache=True, nogil=True)
def exciter_at(forces, force_rates, force_middles, node, at, force, rate):  # type: ignore[no-untyped-def]
    """force, rate (3,): of the exciter at a share ``at`` of the interval that begins at ``node``."""
    following = min(node + 1, forces.shape[0] - 1)
    for i in range(3):
        force[i] = forces[node, i] + at * (forces[following, i] - forces[node, i])
        force[i] += 4.0 * at * (1.0 - at) * force_middles[node, i]
        rate[i] = force_rates[node, i] + at * (force_rates[following, i] - force_rates[node, i])


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
    nodes_x,
    nodes_R,
    nodes_out,
    line_x,
    line_R,
    line_modes,
):
    """Integrate from node 0 to node N - 1, ``step`` seconds apart; returns nodes done (N: all went well).

    x (12 + 2 s,) and reference (3, 3): start, destroyed; s: internal coordinates.
    forces, force_rates (N, 3): exciter force in its frame and its rate at the nodes, linear between;
    force_middles (N, 3): what the force has midway to the next node beyond that line (a parabola).
    wrenches (N, 6): further wrench,
    body axes, held over the interval.
    Filled: nodes_x (N, X), X = 12 + 2 s, nodes_R (N, 3, 3), nodes_out (N, OUT_TENSION + n); and for
    variation.py the motion at the 2 L points that begin and halve L equal parts of each interval, none
    where L is zero, which ``substeps`` is a multiple of: line_x (N, 2 L, X) with phi = 0, line_R
    (N, 2 L, 3, 3) and line_modes (N, 2 L, n).
    """
    nodes = forces.shape[0]
    n = modes.shape[0]
    states = x.shape[0]
    internal = (states - BODY_STATE) // 2
    size = 6 + n + internal
    K = np.empty((size, size))
    r = np.empty(size)
    inverse = np.empty((0, size))
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
    # Points in halves of a substep: in the middle of an odd number of substeps there is none
    apart = 0 if line_x.shape[1] == 0 else 2 * substeps // line_x.shape[1]
    for node in range(nodes):
        last = node == nodes - 1
        wrench = wrenches[node]
        for sub in range(1 if last else substeps):
            for s in range(4):
                for i in range(states):
                    y[i] = x[i] + (h * ahead[s] * k[s - 1, i] if s > 0 else 0.0)
                exciter_at(forces, force_rates, force_middles, node, (sub + ahead[s]) / substeps, force, rate)
                rotation(reference, y, R)
                if not solve(physics, modes, mount, y, R, force, wrench, K, r, inverse, z):
                    return node
                if s == 0 and _switch_cables(physics, modes, y, reference, z, can_slacken):
                    project_state(physics, modes, x, reference)
                    y[:] = x
                    rotation(reference, y, R)
                    if not solve(physics, modes, mount, y, R, force, wrench, K, r, inverse, z):
                        return node
                if s == 0 and sub == 0:
                    nodes_x[node] = y
                    nodes_R[node] = R
                    _write_outputs(physics, modes, R, y, z, nodes_out[node])
                halves = 2 * sub + (0 if s == 0 else 1)
                if apart > 0 and (s == 0 or s == 2) and halves % apart == 0:
                    point = halves // apart
                    line_x[node, point] = y
                    line_x[node, point, ROTATION : ROTATION + 3] = 0.0
                    line_R[node, point] = R
                    line_modes[node, point] = modes
                if s == 0 and last:
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
            for i in range(states):
                total_rate = 0.0
                for s in range(4):
                    total_rate += weights[s] * k[s, i]
                x[i] += h * total_rate
                if not abs(x[i]) < 1e6:
                    return node
            update_reference(reference, x)
            project_state(physics, modes, x, reference)
    return nodes
