"""Equations of motion of a rigid body on cables, as one linear system in accelerations and tensions.

State (local to one integration step, right-hand rotation increment phi on R_ref):
    x = (p, phi, v, w): datum position and velocity in world, body rate in body axes;
    R = R_ref Exp(phi).
Unknowns
    z = (A, alpha, T_1 ... T_n): A = R^T dv/dt (datum acceleration in body axes), angular
    acceleration in body axes, cable tensions.
With mass m, first moment h = m c and inertia I about the datum, gravity g in world, and
forces f_k at r_k in body axes, Newton and Euler about the datum read
    m A + alpha x h = sum f + m R^T g - w x (w x h)
    h x A + I alpha = sum r x f + h x R^T g - w x (I w)
(thesis eq. 3.4 to 3.9, with the gyroscopic term that the thesis leaves out).
Cable i pulls with T_i along the unit vector u_i from its body hinge b_i to its ceiling
hinge. Its length l_i gives the last n rows:
    rigid:    d^2 l/dt^2 = 0, that is
              -u.(A + alpha x b) = u.(w x (w x b)) - (|s|^2 - (u.s)^2)/l,   s = R^T v + w x b
    elastic:  T = EA/L (l - L + tau dl/dt)         (Kelvin-Voigt; zero where it would push)
    slack:    T = 0
Effects with internal coordinates (effects/internal.py) append q to the state (q and dq/dt
after w) and d^2q/dt^2 to z, behind the tensions.
``assemble`` fills K and r of K z = r. It is written for real and complex arrays alike, so
the same lines give the exact derivative in any input (see arithmetic.py): from
K z = r follows dz = K^-1 (dr - dK z).
"""

from __future__ import annotations

from numba import njit

from rig_identification.model.arithmetic import reciprocal, root
from rig_identification.model.effects.all import add_effects
from rig_identification.model.effects.internal import add_ceiling, ceiling_shift
from rig_identification.model.effects.place import SHARING
from rig_identification.model.effects.point import force_at
from rig_identification.model.layout import (
    AXIAL_DAMPING,
    AXIAL_STIFFNESS,
    BODY_POINT,
    CABLE_SIZE,
    CABLES,
    CEILING_POINT,
    ELASTIC,
    EXCITER_GAIN,
    EXCITER_POSITION,
    EXCITER_ROTATION,
    GRAVITY,
    INERTIAL,
    LENGTH,
    RATE,
    RIGID,
    ROTATION,
    SLACK,
    VELOCITY,
)


@njit(cache=True)
def rotation(reference, x, out):  # type: ignore[no-untyped-def]
    """out (3, 3) = reference Exp(phi), phi = x[ROTATION:]; a series, exact to 1e-15 for |phi| < 0.05."""
    a, b, c = x[ROTATION], x[ROTATION + 1], x[ROTATION + 2]
    t = a * a + b * b + c * c
    s1 = 1.0 - t * (1.0 / 6.0 - t * (1.0 / 120.0 - t / 5040.0))
    s2 = 0.5 - t * (1.0 / 24.0 - t * (1.0 / 720.0 - t / 40320.0))
    e00 = 1.0 - s2 * (b * b + c * c)
    e11 = 1.0 - s2 * (a * a + c * c)
    e22 = 1.0 - s2 * (a * a + b * b)
    e01 = s2 * a * b - s1 * c
    e10 = s2 * a * b + s1 * c
    e02 = s2 * a * c + s1 * b
    e20 = s2 * a * c - s1 * b
    e12 = s2 * b * c - s1 * a
    e21 = s2 * b * c + s1 * a
    for i in range(3):
        r0, r1, r2 = reference[i, 0], reference[i, 1], reference[i, 2]
        out[i, 0] = r0 * e00 + r1 * e10 + r2 * e20
        out[i, 1] = r0 * e01 + r1 * e11 + r2 * e21
        out[i, 2] = r0 * e02 + r1 * e12 + r2 * e22


@njit(cache=True)
def rotation_rate(x, out):  # type: ignore[no-untyped-def]
    """out (3,) = d phi/dt = J_r^-1(phi) w (Sola, "A micro Lie theory", 2018, eq. 144), as a series."""
    a, b, c = x[ROTATION], x[ROTATION + 1], x[ROTATION + 2]
    w0, w1, w2 = x[RATE], x[RATE + 1], x[RATE + 2]
    t = a * a + b * b + c * c
    k = 1.0 / 12.0 + t * (1.0 / 720.0 + t / 30240.0)
    x0 = b * w2 - c * w1
    x1 = c * w0 - a * w2
    x2 = a * w1 - b * w0
    out[0] = w0 + 0.5 * x0 + k * (b * x2 - c * x1)
    out[1] = w1 + 0.5 * x1 + k * (c * x0 - a * x2)
    out[2] = w2 + 0.5 * x2 + k * (a * x1 - b * x0)


@njit(cache=True)
def add_body(physics, x, R, K, r):  # type: ignore[no-untyped-def]
    """Fill the body's own rows of K and r, which are zero: inertia, gyroscopic terms, weight."""
    m = physics[INERTIAL]
    hx, hy, hz = physics[INERTIAL + 1], physics[INERTIAL + 2], physics[INERTIAL + 3]
    ixx, ixy, ixz = physics[INERTIAL + 4], physics[INERTIAL + 5], physics[INERTIAL + 6]
    iyy, iyz, izz = physics[INERTIAL + 7], physics[INERTIAL + 8], physics[INERTIAL + 9]
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    K[0, 0] = m
    K[1, 1] = m
    K[2, 2] = m
    K[0, 4] = hz
    K[0, 5] = -hy
    K[1, 3] = -hz
    K[1, 5] = hx
    K[2, 3] = hy
    K[2, 4] = -hx
    K[4, 0] = hz
    K[5, 0] = -hy
    K[3, 1] = -hz
    K[5, 1] = hx
    K[3, 2] = hy
    K[4, 2] = -hx
    K[3, 3] = ixx
    K[3, 4] = ixy
    K[3, 5] = ixz
    K[4, 3] = ixy
    K[4, 4] = iyy
    K[4, 5] = iyz
    K[5, 3] = ixz
    K[5, 4] = iyz
    K[5, 5] = izz
    g0, g1, g2 = physics[GRAVITY], physics[GRAVITY + 1], physics[GRAVITY + 2]
    gx = R[0, 0] * g0 + R[1, 0] * g1 + R[2, 0] * g2
    gy = R[0, 1] * g0 + R[1, 1] * g1 + R[2, 1] * g2
    gz = R[0, 2] * g0 + R[1, 2] * g1 + R[2, 2] * g2
    # w x h, then w x (w x h)
    ax = wy * hz - wz * hy
    ay = wz * hx - wx * hz
    az = wx * hy - wy * hx
    r[0] = m * gx - (wy * az - wz * ay)
    r[1] = m * gy - (wz * ax - wx * az)
    r[2] = m * gz - (wx * ay - wy * ax)
    lx = ixx * wx + ixy * wy + ixz * wz
    ly = ixy * wx + iyy * wy + iyz * wz
    lz = ixz * wx + iyz * wy + izz * wz
    r[3] = hy * gz - hz * gy - (wy * lz - wz * ly)
    r[4] = hz * gx - hx * gz - (wz * lx - wx * lz)
    r[5] = hx * gy - hy * gx - (wx * ly - wy * lx)


@njit(cache=True)
def add_cable(physics, i, modes, x, R, K, r):  # type: ignore[no-untyped-def]
    """Fill cable i's row and column of K and its entry of r, which are zero."""
    n = modes.shape[0]
    size = r.shape[0]
    o = CABLES + CABLE_SIZE * i
    wx, wy, wz = x[RATE], x[RATE + 1], x[RATE + 2]
    p0, p1, p2 = x[0], x[1], x[2]
    v0, v1, v2 = x[VELOCITY], x[VELOCITY + 1], x[VELOCITY + 2]
    if size > 6 + n:
        # Cables see the body from their upper hinges, which a yielding ceiling moves
        s0, s1, s2, c0, c1, c2 = ceiling_shift(physics, n, x, i)
        p0, p1, p2, v0, v1, v2 = p0 - s0, p1 - s1, p2 - s2, v0 - c0, v1 - c1, v2 - c2
    vx = R[0, 0] * v0 + R[1, 0] * v1 + R[2, 0] * v2
    vy = R[0, 1] * v0 + R[1, 1] * v1 + R[2, 1] * v2
    vz = R[0, 2] * v0 + R[1, 2] * v1 + R[2, 2] * v2
    row = 6 + i
    if modes[i] == SLACK:
        K[row, row] = 1.0
        return
    bx, by, bz = physics[o + BODY_POINT], physics[o + BODY_POINT + 1], physics[o + BODY_POINT + 2]
    d0 = physics[o + CEILING_POINT] - p0
    d1 = physics[o + CEILING_POINT + 1] - p1
    d2 = physics[o + CEILING_POINT + 2] - p2
    dx = R[0, 0] * d0 + R[1, 0] * d1 + R[2, 0] * d2 - bx
    dy = R[0, 1] * d0 + R[1, 1] * d1 + R[2, 1] * d2 - by
    dz = R[0, 2] * d0 + R[1, 2] * d1 + R[2, 2] * d2 - bz
    length = root(dx * dx + dy * dy + dz * dz)
    per_length = reciprocal(length)
    ux, uy, uz = dx * per_length, dy * per_length, dz * per_length
    mx = by * uz - bz * uy
    my = bz * ux - bx * uz
    mz = bx * uy - by * ux
    K[0, row] = -ux
    K[1, row] = -uy
    K[2, row] = -uz
    K[3, row] = -mx
    K[4, row] = -my
    K[5, row] = -mz
    if size > 6 + n:
        add_ceiling(physics, n, x, R, i, ux, uy, uz, modes[i] == RIGID, K)
    # w x b; s: velocity of the body hinge
    ex = wy * bz - wz * by
    ey = wz * bx - wx * bz
    ez = wx * by - wy * bx
    sx, sy, sz = vx + ex, vy + ey, vz + ez
    along = ux * sx + uy * sy + uz * sz
    if modes[i] == RIGID:
        K[row, 0] = -ux
        K[row, 1] = -uy
        K[row, 2] = -uz
        K[row, 3] = -mx
        K[row, 4] = -my
        K[row, 5] = -mz
        # Softness at acceleration level: zero but where more cables than needed hold the body
        K[row, row] = -physics[CABLES + CABLE_SIZE * n + SHARING]
        r[row] = (
            ux * (wy * ez - wz * ey)
            + uy * (wz * ex - wx * ez)
            + uz * (wx * ey - wy * ex)
            - (sx * sx + sy * sy + sz * sz - along * along) * per_length
        )
    else:
        unloaded = physics[o + LENGTH]
        K[row, row] = 1.0
        tension = (
            physics[o + AXIAL_STIFFNESS]
            * reciprocal(unloaded)
            * (length - unloaded - physics[o + AXIAL_DAMPING] * along)
        )
        if modes[i] == ELASTIC and (tension.real < 0.0 or length.real < unloaded.real):
            r[row] = 0.0
        else:
            r[row] = tension


@njit(cache=True)
def add_exciter(physics, mount, force, r):  # type: ignore[no-untyped-def]
    """Exciter force (measured, exciter frame) at its mount; the mount's rotation error to second order."""
    gain = physics[EXCITER_GAIN]
    f0 = gain * (mount[0, 0] * force[0] + mount[0, 1] * force[1] + mount[0, 2] * force[2])
    f1 = gain * (mount[1, 0] * force[0] + mount[1, 1] * force[1] + mount[1, 2] * force[2])
    f2 = gain * (mount[2, 0] * force[0] + mount[2, 1] * force[1] + mount[2, 2] * force[2])
    a, b, c = physics[EXCITER_ROTATION], physics[EXCITER_ROTATION + 1], physics[EXCITER_ROTATION + 2]
    t0 = b * f2 - c * f1
    t1 = c * f0 - a * f2
    t2 = a * f1 - b * f0
    fx = f0 + t0 + 0.5 * (b * t2 - c * t1)
    fy = f1 + t1 + 0.5 * (c * t0 - a * t2)
    fz = f2 + t2 + 0.5 * (a * t1 - b * t0)
    px, py, pz = physics[EXCITER_POSITION], physics[EXCITER_POSITION + 1], physics[EXCITER_POSITION + 2]
    force_at(px, py, pz, fx, fy, fz, r)


@njit(cache=True)
def assemble(physics, modes, mount, x, R, force, wrench, K, r):  # type: ignore[no-untyped-def]
    """Fill K (6 + n + s, 6 + n + s) and r (6 + n + s,) of K z = r, with s internal coordinates.

    physics: flat array of layout.py. modes (n,): see layout.py. mount (3, 3):
    described orientation of the exciter frame in body. x: local state. R (3, 3): pose.
    force (3,): measured exciter force, exciter frame, N. wrench (6,): further force N and
    moment about the datum N m, body axes.
    """
    size = r.shape[0]
    for i in range(size):
        r[i] = 0.0
        for j in range(size):
            K[i, j] = 0.0
    add_body(physics, x, R, K, r)
    for i in range(6):
        r[i] += wrench[i]
    add_exciter(physics, mount, force, r)
    for i in range(modes.shape[0]):
        add_cable(physics, i, modes, x, R, K, r)
    add_effects(physics, modes, x, R, K, r)
