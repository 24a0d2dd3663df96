"""Strapdown integration of an IMU with an error-state Kalman filter, one sample at a time.

State at the IMU's origin: position (m, world), R_world_body, velocity (m/s, world), gyroscope
and accelerometer bias (body axes). Error state (15,): position, rotation (body, right),
velocity, the two biases (Sola, "Quaternion kinematics for the error-state Kalman filter",
2017, sections 5 and 6). Integrated alone it drifts; the cables' lengths, gravity's
direction from inclinometers and the direction in which the cables pull hold it. The surprise of a
measurement is its squared innovations over their variances, summed: its number of components on the average.
"""

from __future__ import annotations

import numpy as np
from numba import njit

ERRORS = 15
POSITION, ROTATION, VELOCITY, GYROSCOPE, ACCELEROMETER = 0, 3, 6, 9, 12


@njit(cache=True, nogil=True)
def _turn(R, phi):  # type: ignore[no-untyped-def]
    """R Exp(phi) in place (Rodrigues)."""
    angle = np.sqrt(phi[0] ** 2 + phi[1] ** 2 + phi[2] ** 2)
    if angle < 1e-9:
        a, b = 1.0, 0.5
    else:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle**2
    S = np.array([[0.0, -phi[2], phi[1]], [phi[2], 0.0, -phi[0]], [-phi[1], phi[0], 0.0]])
    R[:, :] = R @ (np.eye(3) + a * S + b * (S @ S))


@njit(cache=True, nogil=True)
def _cross(a, b):  # type: ignore[no-untyped-def]
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@njit(cache=True, nogil=True)
def propagate_sample(p, R, v, bias, P, rate, force, dt, gravity, noise):  # type: ignore[no-untyped-def]
    """One IMU interval of dt s. rate, force (3,): mean over it, body axes, measured.

    noise (4,): standard deviation of one sample of rate and force, and the biases' random
    walks per square root second.
    """
    w = rate - bias[:3]
    f = force - bias[3:]
    a = R @ f
    a[2] -= gravity
    for i in range(3):
        p[i] += dt * v[i] + 0.5 * dt * dt * a[i]
        v[i] += dt * a[i]
    # dx' = F dx: position by velocity, rotation by itself and gyro bias, velocity by rotation and accel bias
    F = np.eye(ERRORS)
    W = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    G = np.array([[0.0, -f[2], f[1]], [f[2], 0.0, -f[0]], [-f[1], f[0], 0.0]])
    RG = R @ G
    for i in range(3):
        F[POSITION + i, VELOCITY + i] = dt
        F[ROTATION + i, GYROSCOPE + i] = -dt
        for j in range(3):
            F[ROTATION + i, ROTATION + j] -= dt * W[i, j]
            F[VELOCITY + i, ROTATION + j] = -dt * RG[i, j]
            F[VELOCITY + i, ACCELEROMETER + j] = -dt * R[i, j]
    P[:, :] = F @ P @ F.T
    for i in range(3):
        P[ROTATION + i, ROTATION + i] += (noise[0] * dt) ** 2
        P[VELOCITY + i, VELOCITY + i] += (noise[1] * dt) ** 2
        P[GYROSCOPE + i, GYROSCOPE + i] += noise[2] ** 2 * dt
        P[ACCELEROMETER + i, ACCELEROMETER + i] += noise[3] ** 2 * dt
    _turn(R, dt * w)


@njit(cache=True, nogil=True)
def _update(P, error, h, residual, variance):  # type: ignore[no-untyped-def]
    """One scalar measurement: residual = h dx + noise. ``error`` collects the correction.

    Returns the squared innovation over its variance: 1 on the average, if the state is what P says.
    """
    gain = P @ h
    spread = variance + h @ gain
    innovation = residual - h @ error
    miss = innovation / spread
    for i in range(ERRORS):
        error[i] += gain[i] * miss
    scaled = gain / spread
    for i in range(ERRORS):
        for j in range(ERRORS):
            P[i, j] -= scaled[i] * gain[j]
    return innovation * miss


@njit(cache=True, nogil=True)
def _inject(p, R, v, bias, P, error):  # type: ignore[no-untyped-def]
    """Take the correction into the state."""
    for i in range(3):
        p[i] += error[POSITION + i]
        v[i] += error[VELOCITY + i]
        bias[i] += error[GYROSCOPE + i]
        bias[3 + i] += error[ACCELEROMETER + i]
    _turn(R, error[ROTATION : ROTATION + 3])
    for i in range(ERRORS):
        for j in range(i):
            mean = 0.5 * (P[i, j] + P[j, i])
            P[i, j] = P[j, i] = mean
        P[i, i] = max(P[i, i], 1e-16)


@njit(cache=True, nogil=True)
def update_cables(p, R, v, bias, P, rate, ceiling, arms, lengths, length_std, speed_std, limit):  # type: ignore[no-untyped-def]
    """Every cable has its length and keeps it. Returns the surprise; one above ``limit`` changes nothing.

    ceiling (n, 3): hinges in world; arms (n, 3): hinges on the body less the IMU's position,
    body axes; length_std m; speed_std m/s: how far a cable may be from keeping its length.
    """
    error = np.zeros(ERRORS)
    h = np.zeros(ERRORS)
    before, surprise = P.copy(), 0.0
    w = rate - bias[:3]
    for i in range(lengths.shape[0]):
        arm = R @ arms[i]
        along = p + arm - ceiling[i]
        length = np.sqrt(along @ along)
        u = along / length
        body_u = R.T @ u
        turn = _cross(arms[i], body_u)
        h[:] = 0.0
        h[POSITION : POSITION + 3] = u
        h[ROTATION : ROTATION + 3] = turn
        surprise += _update(P, error, h, lengths[i] - length, length_std**2)
        hinge = v + R @ _cross(w, arms[i])
        h[:] = 0.0
        h[VELOCITY : VELOCITY + 3] = u
        h[GYROSCOPE : GYROSCOPE + 3] = -turn
        # How the rate changes as the cable's direction turns
        across = (hinge - u * (u @ hinge)) / length
        h[POSITION : POSITION + 3] = across
        h[ROTATION : ROTATION + 3] = _cross(arms[i], R.T @ across) + _cross(_cross(w, arms[i]), body_u)
        surprise += _update(P, error, h, -(u @ hinge), speed_std**2)
    if surprise > limit:
        P[:, :] = before
    else:
        _inject(p, R, v, bias, P, error)
    return surprise


@njit(cache=True, nogil=True)
def update_axes_up(p, R, v, bias, P, axes, sines, std, limit):  # type: ignore[no-untyped-def]
    """Body-fixed axes (m, 3) rise above the horizontal plane with these sines (m,).

    Returns the surprise; one above ``limit`` changes nothing.
    """
    error = np.zeros(ERRORS)
    h = np.zeros(ERRORS)
    before, surprise = P.copy(), 0.0
    up = R[2].copy()
    for i in range(sines.shape[0]):
        h[:] = 0.0
        # d(axis . (up x dtheta)) = (axis x up) . dtheta
        h[ROTATION : ROTATION + 3] = _cross(axes[i], up)
        surprise += _update(P, error, h, sines[i] - axes[i] @ up, std**2)
    if surprise > limit:
        P[:, :] = before
    else:
        _inject(p, R, v, bias, P, error)
    return surprise


@njit(cache=True, nogil=True)
def update_pull(p, R, v, bias, P, specific_force, tension, applied, ceiling, arms, std):  # type: ignore[no-untyped-def]
    """The body accelerates along what pulls it: directions of specific force and of applied force agree.

    specific_force (3,): at the centre of mass, body axes, measured; tension (n,) N; applied (3,):
    exciter's force, body axes, N. Directions alone are compared, so that no mass is needed.
    """
    error = np.zeros(ERRORS)
    h = np.zeros((3, ERRORS))
    total = R @ applied
    slope = np.zeros((3, 6))
    for i in range(tension.shape[0]):
        arm = R @ arms[i]
        along = ceiling[i] - p - arm
        length = np.sqrt(along @ along)
        u = along / length
        total += tension[i] * u
        own = (np.outer(u, u) - np.eye(3)) * (tension[i] / length)
        slope[:, :3] += own
        # dhinge = -R [arm] dtheta
        S = np.array(
            [[0.0, -arms[i, 2], arms[i, 1]], [arms[i, 2], 0.0, -arms[i, 0]], [-arms[i, 1], arms[i, 0], 0.0]]
        )
        slope[:, 3:] -= own @ (R @ S)
    size = np.sqrt(total @ total)
    f = R @ (specific_force - bias[3:])
    f_size = np.sqrt(f @ f)
    if size < 1e-6 or f_size < 1e-3:
        return
    S_f = np.zeros((3, 3))
    g = specific_force - bias[3:]
    S_f[0, 1], S_f[0, 2], S_f[1, 0] = -g[2], g[1], g[2]
    S_f[1, 2], S_f[2, 0], S_f[2, 1] = -g[0], -g[1], g[0]
    h[:, POSITION : POSITION + 3] = slope[:, :3] / size
    h[:, ROTATION : ROTATION + 3] = slope[:, 3:] / size + (R @ S_f) / f_size
    h[:, ACCELEROMETER : ACCELEROMETER + 3] = R / f_size
    direction = total / size
    # Only the direction is measured: what a change does along it says nothing
    for c in range(ERRORS):
        along_it = direction @ np.ascontiguousarray(h[:, c])
        for i in range(3):
            h[i, c] -= direction[i] * along_it
    residual = f / f_size - direction
    for i in range(3):
        _update(P, error, h[i], residual[i], std**2)
    _inject(p, R, v, bias, P, error)
