"""The few formulas that run at every step, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit

from bench.concealed.scene import Array


@njit(cache=True)
def predict(
    pose: Array, velocity: Array, acceleration: Array, ahead: float
) -> tuple[Array, Array, Array, Array]:
    """Position (3,), rotation (3, 3), velocity (3,) and rate (3,) of a free body ``ahead`` seconds on.

    ``pose`` (7+,) is position and quaternion wxyz; ``velocity`` and ``acceleration`` (6+,) are linear in
    world, then angular in body. Second order in ``ahead``.
    """
    position = pose[:3] + ahead * (velocity[:3] + 0.5 * ahead * acceleration[:3])
    turn = ahead * (velocity[3:6] + 0.5 * ahead * acceleration[3:6])
    w, x, y, z = pose[3], pose[4], pose[5], pose[6]
    a, b, c = 0.5 * turn[0], 0.5 * turn[1], 0.5 * turn[2]
    w, x, y, z = (
        w - x * a - y * b - z * c,
        x + w * a + y * c - z * b,
        y + w * b + z * a - x * c,
        z + w * c + x * b - y * a,
    )
    scale = 2.0 / (w * w + x * x + y * y + z * z)
    rotation = np.empty((3, 3))
    rotation[0, 0] = 1.0 - scale * (y * y + z * z)
    rotation[0, 1] = scale * (x * y - w * z)
    rotation[0, 2] = scale * (x * z + w * y)
    rotation[1, 0] = scale * (x * y + w * z)
    rotation[1, 1] = 1.0 - scale * (x * x + z * z)
    rotation[1, 2] = scale * (y * z - w * x)
    rotation[2, 0] = scale * (x * z - w * y)
    rotation[2, 1] = scale * (y * z + w * x)
    rotation[2, 2] = 1.0 - scale * (x * x + y * y)
    return (
        position,
        rotation,
        velocity[:3] + ahead * acceleration[:3],
        velocity[3:6] + ahead * acceleration[3:6],
    )


@njit(cache=True)
def put_body_force(applied: Array, rotation: Array, force_body: Array, point_body: Array) -> None:
    """Set ``applied`` (6+,) to the generalised force of a force at a point, both (3,) in body axes."""
    applied[:] = 0.0
    for i in range(3):
        for j in range(3):
            applied[i] += rotation[i, j] * force_body[j]
    applied[3] = point_body[1] * force_body[2] - point_body[2] * force_body[1]
    applied[4] = point_body[2] * force_body[0] - point_body[0] * force_body[2]
    applied[5] = point_body[0] * force_body[1] - point_body[1] * force_body[0]


@njit(cache=True)
def hinge_rates(
    ceiling: Array,
    hinge: Array,
    position: Array,
    rotation: Array,
    velocity: Array,
    rate: Array,
    follow: float,
) -> tuple[Array, Array]:
    """By cable: angular rate of the cable (n, 3), and of the body against it (n, 3).

    World axes. Swinging turns the cable at u x du/dt; besides, it spins about itself at ``follow`` times
    the body's rate about it: half where both hinges resist alike, 1 where the one at the ceiling is free.
    """
    count = ceiling.shape[0]
    top, bottom = np.empty((count, 3)), np.empty((count, 3))
    spin = rotation @ rate
    for i in range(count):
        arm = rotation @ hinge[i]
        span = position + arm - ceiling[i]
        speed = velocity + np.cross(spin, arm)
        twist = np.dot(span, spin) / np.dot(span, span)
        top[i] = np.cross(span, speed) / np.dot(span, span) + follow * twist * span
        bottom[i] = spin - top[i]
    return top, bottom


@njit(cache=True)
def hinge_moments_on_body(
    ceiling: Array, hinge: Array, position: Array, rotation: Array, top: Array, bottom: Array
) -> Array:
    """(6,) generalised force on the body of hinge moments in massless cables.

    ``top`` (n, 3): moment of the ceiling on the cable; ``bottom`` (n, 3): moment of the cable on the body;
    world axes. The massless cable passes what is left of both on as a transverse force at the body's hinge.
    """
    out = np.zeros(6)
    moment = np.zeros(3)
    for i in range(ceiling.shape[0]):
        arm = rotation @ hinge[i]
        span = position + arm - ceiling[i]
        # Moments on the cable: top - bottom + span x (force of the body on the cable) = 0, but for its spin.
        net = top[i] - bottom[i]
        force = np.cross(net, span) / np.dot(span, span)
        out[:3] += force
        moment += bottom[i] + np.cross(arm, force)
    out[3:] = rotation.T @ moment
    return out
