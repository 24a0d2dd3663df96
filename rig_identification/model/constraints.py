"""Keeping rigid cables at their length: projection of state and sensitivities.

The equations hold d^2 l/dt^2 = 0 only, so rounding and truncation let l drift. After each
step the state goes back to l = L, dl/dt = 0 along the shortest way,
    q <- q - G^+ (l - L),   v <- v - G^+ G v,   G = dl/dq,  G^+ = G^T (G G^T)^-1,
(Hairer & Wanner, Solving ODEs II, VII.2), and the sensitivities to the tangent of
{l(q, p) = L, G(q, p) v = 0}, so that the columns stay exact derivatives in a geometry
parameter p as well.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rig_identification.model.arithmetic import STEP, invert, reciprocal, root
from rig_identification.model.cable_line import cable_line, cross, hinge_change, line_change
from rig_identification.model.dynamics import rotation
from rig_identification.model.effects.internal import ceiling_shift
from rig_identification.model.layout import (
    BODY_POINT,
    BODY_STATE,
    CABLE_SIZE,
    CABLES,
    CEILING_POINT,
    LENGTH,
    RATE,
    RIGID,
    ROTATION,
    VELOCITY,
)


@njit(cache=True)
def cable_length_and_rate(physics, offset, shift, x, R, gradient):  # type: ignore[no-untyped-def]
    """(l, dl/dt) of the cable at ``offset``; gradient (6,) = dl/d(position, rotation increment).

    shift: of the upper hinges and its rate (effects/internal.py). dl/dt equals
    gradient . (v - its rate, w).
    """
    s0, s1, s2, c0, c1, c2 = shift
    bx, by, bz = (
        physics[offset + BODY_POINT],
        physics[offset + BODY_POINT + 1],
        physics[offset + BODY_POINT + 2],
    )
    d0 = physics[offset + CEILING_POINT] + s0 - x[0] - (R[0, 0] * bx + R[0, 1] * by + R[0, 2] * bz)
    d1 = physics[offset + CEILING_POINT + 1] + s1 - x[1] - (R[1, 0] * bx + R[1, 1] * by + R[1, 2] * bz)
    d2 = physics[offset + CEILING_POINT + 2] + s2 - x[2] - (R[2, 0] * bx + R[2, 1] * by + R[2, 2] * bz)
    length = root(d0 * d0 + d1 * d1 + d2 * d2)
    k = reciprocal(length)
    u0, u1, u2 = d0 * k, d1 * k, d2 * k
    ux = R[0, 0] * u0 + R[1, 0] * u1 + R[2, 0] * u2
    uy = R[0, 1] * u0 + R[1, 1] * u1 + R[2, 1] * u2
    uz = R[0, 2] * u0 + R[1, 2] * u1 + R[2, 2] * u2
    gradient[0] = -u0
    gradient[1] = -u1
    gradient[2] = -u2
    gradient[3] = -(by * uz - bz * uy)
    gradient[4] = -(bz * ux - bx * uz)
    gradient[5] = -(bx * uy - by * ux)
    rate = -(gradient[0] * c0 + gradient[1] * c1 + gradient[2] * c2)
    for j in range(3):
        rate += gradient[j] * x[VELOCITY + j] + gradient[3 + j] * x[RATE + j]
    return length, rate


@njit(cache=True)
def rigid_jacobian(physics, modes, x, R, G, gap, rate):  # type: ignore[no-untyped-def]
    """Fill G (n, 6), gap (n,) = l - L and rate (n,) of the rigid cables; returns their number."""
    count = 0
    for i in range(modes.shape[0]):
        if modes[i] == RIGID:
            offset = CABLES + CABLE_SIZE * i
            shift = ceiling_shift(physics, modes.shape[0], x, i)
            length, speed = cable_length_and_rate(physics, offset, shift, x, R, G[count])
            gap[count] = length - physics[offset + LENGTH]
            rate[count] = speed
            count += 1
    return count


@njit(cache=True)
def pseudo_inverse(G, count, out):  # type: ignore[no-untyped-def]
    """out (6, count) = G^T (G G^T)^-1; a trace of regularisation keeps redundant cables solvable."""
    gram = np.empty((count, count))
    inverse = np.empty((count, count))
    for i in range(count):
        for j in range(count):
            total = 0.0
            for k in range(6):
                total += G[i, k] * G[j, k]
            gram[i, j] = total
        gram[i, i] += 1e-12
    invert(gram, inverse)
    for k in range(6):
        for j in range(count):
            total = 0.0
            for i in range(count):
                total += G[i, k] * inverse[i, j]
            out[k, j] = total


@njit(cache=True)
def update_reference(reference, x):  # type: ignore[no-untyped-def]
    """Absorb the rotation increment of x into the reference (re-orthonormalised) and zero it."""
    R = np.empty((3, 3))
    rotation(reference, x, R)
    # One Newton step towards the nearest rotation: R (3 I - R^T R) / 2
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                dot = 0.0
                for m in range(3):
                    dot += R[m, k] * R[m, j]
                total += R[i, k] * ((3.0 if k == j else 0.0) - dot)
            reference[i, j] = 0.5 * total
    for i in range(3):
        x[ROTATION + i] = 0.0


@njit(cache=True)
def project_state(physics, modes, x, reference):  # type: ignore[no-untyped-def]
    """Move state x (12 + 2 s,) and reference (3, 3) onto the cables' manifold; returns max |l - L| before."""
    n = modes.shape[0]
    G = np.empty((n, 6))
    gap = np.empty(n)
    rate = np.empty(n)
    plus = np.empty((6, n))
    first = 0.0
    for iteration in range(20):
        count = rigid_jacobian(physics, modes, x, reference, G, gap, rate)
        if count == 0:
            return 0.0
        largest = np.max(np.abs(gap[:count]))
        if iteration == 0:
            first = largest
        pseudo_inverse(G, count, plus)
        if largest < 1e-13 or (iteration > 0 and largest < 1e-11):
            break
        for k in range(3):
            step = 0.0
            turn = 0.0
            for j in range(count):
                step -= plus[k, j] * gap[j]
                turn -= plus[3 + k, j] * gap[j]
            x[k] += step
            x[ROTATION + k] = min(max(turn, -0.05), 0.05)
        update_reference(reference, x)
    for k in range(6):
        target = VELOCITY + k
        for j in range(count):
            x[target] -= plus[k, j] * rate[j]
    return first


@njit(cache=True)
def _length_changes(physics, n, i, x, R, longer, faster):  # type: ignore[no-untyped-def]
    """longer, faster (12,): derivatives of cable i's l and dl/dt where the local state has no rotation.

    In the pose (position, right-hand rotation increment), the ceiling's point and the body's.
    """
    u, (fx, fy, fz), (vx, vy, vz), _, s, length = cable_line(physics, n, i, x, R)
    for c in range(12):
        a = c % 3
        if c < 3:
            line, speed = (-R[a, 0], -R[a, 1], -R[a, 2]), (0.0, 0.0, 0.0)
        elif c < 6:
            # A vector of the world in body axes turns by v x theta
            hx, hy, hz = 1.0 * (a == 0), 1.0 * (a == 1), 1.0 * (a == 2)
            line, speed = cross(fx, fy, fz, hx, hy, hz), cross(vx, vy, vz, hx, hy, hz)
        else:
            _, line, speed = hinge_change(x, R, c - 6)
        longer[c], _, along = line_change(u, s, length, line, speed)
        faster[c] = -along


@njit(cache=True)
def _add_ceiling_changes(physics, n, i, x, R, columns, defect, rate_defect):  # type: ignore[no-untyped-def]
    """Add to (m,) each what the internal coordinates of ``columns`` do to cable i."""
    offset = CABLES + CABLE_SIZE * i
    xc = x.astype(np.complex128)
    pc = physics.astype(np.complex128)
    Rc = R.astype(np.complex128)
    gc = np.empty(6, dtype=np.complex128)
    for d in range(BODY_STATE, x.shape[0]):
        xc[d] = complex(x[d], STEP)
        length, speed = cable_length_and_rate(pc, offset, ceiling_shift(pc, n, xc, i), xc, Rc, gc)
        for c in range(columns.shape[1]):
            defect[c] += length.imag / STEP * columns[d, c]
            rate_defect[c] += speed.imag / STEP * columns[d, c]
        xc[d] = x[d]


@njit(cache=True)
def project_columns(physics, modes, x, reference, directions, first_direction, columns):  # type: ignore[no-untyped-def]
    """Move sensitivity columns (12 + 2 s, m) of a projected state, phi = 0, to the manifold's tangent.

    Column ``first_direction + k`` is the derivative in physics[directions[k]]
    (directions below 0 touch no geometry); the others in quantities that touch none.
    """
    n = modes.shape[0]
    G = np.empty((n, 6))
    gap = np.empty(n)
    rate = np.empty(n)
    plus = np.empty((6, n))
    count = rigid_jacobian(physics, modes, x, reference, G, gap, rate)
    if count == 0:
        return
    pseudo_inverse(G, count, plus)
    m = columns.shape[1]
    slope = np.zeros((count, 6))
    defect = np.zeros((count, m))
    rate_defect = np.zeros((count, m))
    longer, faster = np.empty(12), np.empty(12)
    row = 0
    for i in range(n):
        if modes[i] != RIGID:
            continue
        offset = CABLES + CABLE_SIZE * i
        _length_changes(physics, n, i, x, reference, longer, faster)
        for d in range(6):
            slope[row, d] = faster[d]
        for k in range(directions.shape[0]):
            number = directions[k] - offset
            if 0 <= number < LENGTH:
                defect[row, first_direction + k] = longer[6 + number]
                rate_defect[row, first_direction + k] = faster[6 + number]
            elif number == LENGTH:
                defect[row, first_direction + k] = -1.0
        if x.shape[0] > BODY_STATE:
            _add_ceiling_changes(physics, n, i, x, reference, columns, defect[row], rate_defect[row])
        row += 1
    _subtract_projection(G, plus, count, defect, columns, 0)
    for row in range(count):
        for d in range(6):
            for c in range(m):
                rate_defect[row, c] += slope[row, d] * columns[d, c]
    _subtract_projection(G, plus, count, rate_defect, columns, VELOCITY)


@njit(cache=True)
def _subtract_projection(G, plus, count, defect, columns, first_row):  # type: ignore[no-untyped-def]
    """columns[first_row : first_row + 6] -= G^+ (defect + G columns)."""
    m = columns.shape[1]
    for row in range(count):
        for d in range(6):
            g = G[row, d]
            for c in range(m):
                defect[row, c] += g * columns[first_row + d, c]
    for d in range(6):
        for row in range(count):
            p = plus[d, row]
            for c in range(m):
                columns[first_row + d, c] -= p * defect[row, c]
