"""Rotation group formulas that scipy's Rotation has not: skew matrices and Jacobians, vectorised.

Conventions after Sola, Deray, Atchuthan, "A micro Lie theory for state estimation in robotics", 2018.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def skew(v: Array) -> Array:
    """(..., 3, 3) matrix of the cross product: skew(v) x = v x x."""
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2] = -v[..., 2], v[..., 1]
    out[..., 1, 0], out[..., 1, 2] = v[..., 2], -v[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -v[..., 1], v[..., 0]
    return out


def nearest_rotation(matrix: Array) -> Array:
    """(3, 3) proper rotation R for which trace(R' matrix) is largest.

    Of a sum of y x' it is the one that brings the vectors x best to the y (Wahba's problem, by singular
    values: Markley, Journal of the Astronautical Sciences 36, 1988).
    """
    U, _, Vt = np.linalg.svd(matrix)
    return np.asarray(U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt)


def left_jacobian(phi: Array) -> Array:
    """(3, 3): Exp(phi + d) = Exp(J_l(phi) d) Exp(phi) to first order."""
    angle = float(np.linalg.norm(phi))
    S = skew(phi)
    if angle < 1e-4:
        return np.asarray(np.eye(3) + 0.5 * S + S @ S / 6.0)
    return np.asarray(
        np.eye(3) + (1.0 - np.cos(angle)) / angle**2 * S + (angle - np.sin(angle)) / angle**3 * S @ S
    )


def inverse_right_jacobian(phi: Array) -> Array:
    """(..., 3, 3): Log(Exp(phi) Exp(d)) = phi + J_r^-1(phi) d to first order; |phi| < pi."""
    angle = np.linalg.norm(phi, axis=-1)[..., None, None]
    safe = np.where(angle < 1e-4, 1.0, angle)
    exact = 1.0 / safe**2 - (1.0 + np.cos(safe)) / (2.0 * safe * np.sin(safe))
    coefficient = np.where(angle < 1e-4, 1.0 / 12.0, exact)
    S = skew(phi)
    return np.asarray(np.eye(3) + 0.5 * S + coefficient * S @ S)
