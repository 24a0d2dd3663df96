"""Cables that resist being twisted: a rope between two clamps turns its end back, about itself.

With R_0 the pose at rest the body is turned by A = R R_0^T. Of that turn w = vee(A - A^T)/2, for small
turns its rotation vector, cable i (direction u_i, ceiling to body) is twisted by s_i = w . u_i, what is bent
or leans about its hinges being free. Its clamps were tightened with the body held otherwise than it hangs:
untwisted it would be with the body turned by -c, and to first order in c it stores
    V = 1/2 k s_i^2 + s_i p_i,      p_i = q . u_i,      q = k c.
With q, in N m, for a number rather than c all is linear in the two. From
    [phi]A + A^T[phi] = [(tr(A) 1 - A) phi]     for any phi
a turn of the body by phi changes w by (tr(A) 1 - A) phi / 2, and a move of its hinge by d changes u_i by
(1 - u_i u_i^T) d / L_i, so that on the body act, with t_i = k s_i + p_i,
    at the hinge   f_i = -[t_i (w - s_i u_i) + s_i (q - p_i u_i)] / L_i,
    besides        m_i = -t_i (tr(A) u_i - A^T u_i) / 2,
which for small turns is the moment -t_i u_i alone. About the vertical n cables add n k to what turns
the body back: at one frequency nothing tells that from less inertia.
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.cable_line import in_body
from rig_identification.model.effects.direction import cable_direction
from rig_identification.model.effects.place import REFERENCE_ROTATION, TORSION, TWISTED, active
from rig_identification.model.layout import BODY_POINT, CABLE_SIZE, CABLES, SLACK


@njit(cache=True)
def add_cable_torsion(physics, block, modes, cables, x, R, r):  # type: ignore[no-untyped-def]
    """Add the wrench of some twisted cables to r, in body axes: there A is R_0^T R."""
    stiffness = physics[block + TORSION]
    q0, q1, q2 = physics[block + TWISTED], physics[block + TWISTED + 1], physics[block + TWISTED + 2]
    if not (active(stiffness) or active(q0) or active(q1) or active(q2)):
        return
    qx, qy, qz = in_body(R, q0, q1, q2)
    t = block + REFERENCE_ROTATION
    rest = physics[t : t + 9].reshape(3, 3)
    a00 = rest[0, 0] * R[0, 0] + rest[1, 0] * R[1, 0] + rest[2, 0] * R[2, 0]
    a01 = rest[0, 0] * R[0, 1] + rest[1, 0] * R[1, 1] + rest[2, 0] * R[2, 1]
    a02 = rest[0, 0] * R[0, 2] + rest[1, 0] * R[1, 2] + rest[2, 0] * R[2, 2]
    a10 = rest[0, 1] * R[0, 0] + rest[1, 1] * R[1, 0] + rest[2, 1] * R[2, 0]
    a11 = rest[0, 1] * R[0, 1] + rest[1, 1] * R[1, 1] + rest[2, 1] * R[2, 1]
    a12 = rest[0, 1] * R[0, 2] + rest[1, 1] * R[1, 2] + rest[2, 1] * R[2, 2]
    a20 = rest[0, 2] * R[0, 0] + rest[1, 2] * R[1, 0] + rest[2, 2] * R[2, 0]
    a21 = rest[0, 2] * R[0, 1] + rest[1, 2] * R[1, 1] + rest[2, 2] * R[2, 1]
    a22 = rest[0, 2] * R[0, 2] + rest[1, 2] * R[1, 2] + rest[2, 2] * R[2, 2]
    wx, wy, wz = 0.5 * (a21 - a12), 0.5 * (a02 - a20), 0.5 * (a10 - a01)
    trace = a00 + a11 + a22
    for i in range(cables[0], cables[1]):
        if modes[i] == SLACK:
            continue
        o = CABLES + CABLE_SIZE * i
        bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
        ux, uy, uz, per_length = cable_direction(physics, o, x[0], x[1], x[2], R)
        twist = wx * ux + wy * uy + wz * uz
        clamped = qx * ux + qy * uy + qz * uz
        moment = -stiffness * twist - clamped
        half = 0.5 * moment
        fx = per_length * (moment * (wx - twist * ux) - twist * (qx - clamped * ux))
        fy = per_length * (moment * (wy - twist * uy) - twist * (qy - clamped * uy))
        fz = per_length * (moment * (wz - twist * uz) - twist * (qz - clamped * uz))
        r[0] += fx
        r[1] += fy
        r[2] += fz
        r[3] += half * (trace * ux - (a00 * ux + a10 * uy + a20 * uz)) + by * fz - bz * fy
        r[4] += half * (trace * uy - (a01 * ux + a11 * uy + a21 * uz)) + bz * fx - bx * fz
        r[5] += half * (trace * uz - (a02 * ux + a12 * uy + a22 * uz)) + bx * fy - by * fx
