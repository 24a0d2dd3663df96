"""Ten inertial parameters in the forms that the model, the estimator and a person use.

- ``elements`` (10,): m, cx, cy, cz, Jxx, Jxy, Jxz, Jyy, Jyz, Jzz; J about the centre of mass,
  off-diagonals as tensor elements (-integral xy dm). What a person reads.
- ``linear`` (10,): m, m c, I about the body datum. What Newton-Euler is linear in.
- ``log_cholesky`` (10,): any real ten numbers give a body that can exist (Rucker & Wensing,
  "Smooth Parameterization of Rigid-Body Inertia", IEEE RA-L 7, 2022): the pseudo-inertia
  P = [[S, h], [h^T, m]], S = tr(I)/2 1 - I, is kept positive definite as P = U U^T with U upper
  triangular, U = e^a [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3], [0, 0, 0, 1]].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


def tensor(six: Array) -> Array:
    """(3, 3) symmetric tensor of xx, xy, xz, yy, yz, zz."""
    xx, xy, xz, yy, yz, zz = six
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def six_elements(matrix: Array) -> Array:
    """xx, xy, xz, yy, yz, zz of a (3, 3) symmetric tensor."""
    return np.array([matrix[i, j] for i, j in _PAIRS])


def point_inertia(mass: float, position: Array) -> Array:
    """(3, 3) inertia about the origin of a point mass: m (|c|^2 1 - c c^T)."""
    return mass * (position @ position * np.eye(3) - np.outer(position, position))


def linear_from_elements(elements: Array) -> Array:
    """(m, m c, I about the datum) from (m, c, J about the centre of mass)."""
    mass, center = elements[0], elements[1:4]
    about_datum = tensor(elements[4:]) + point_inertia(mass, center)
    return np.concatenate([[mass], mass * center, six_elements(about_datum)])


def elements_from_linear(linear: Array) -> Array:
    """(m, c, J about the centre of mass) from (m, m c, I about the datum)."""
    mass = linear[0]
    center = linear[1:4] / mass
    about_center = tensor(linear[4:]) - point_inertia(mass, center)
    return np.concatenate([[mass], center, six_elements(about_center)])


def linear_from_log_cholesky(theta: Array) -> Array:
    """(m, m c, I about the datum) from ten unconstrained numbers (class of the docstring above)."""
    U = _triangle(theta)
    return _linear_of(U @ U.T)


def linear_in_log_cholesky(theta: Array) -> Array:
    """(10, 10) derivative of :func:`linear_from_log_cholesky`: of U U^T it is dU U^T and its transpose."""
    U = _triangle(theta)
    change = np.zeros((10, 4, 4))
    change[0] = U
    scale = np.exp(theta[0])
    for k in range(3):
        change[1 + k, k, k] = U[k, k]
        change[7 + k, k, 3] = scale
    for k, (i, j) in enumerate(((0, 1), (1, 2), (0, 2))):
        change[4 + k, i, j] = scale
    half = change @ U.T
    return np.stack([_linear_of(P) for P in half + half.transpose(0, 2, 1)], axis=1)


def _triangle(theta: Array) -> Array:
    """(4, 4) factor of the pseudo-inertia matrix U U^T."""
    a, d1, d2, d3, s12, s23, s13, t1, t2, t3 = theta
    zero = 0.0 * a
    return np.asarray(
        np.exp(a)
        * np.array(
            [
                [np.exp(d1), s12, s13, t1],
                [zero, np.exp(d2), s23, t2],
                [zero, zero, np.exp(d3), t3],
                [zero, zero, zero, 1.0 + zero],
            ]
        )
    )


def _linear_of(P: Array) -> Array:
    """(m, m c, I about the datum) of a pseudo-inertia matrix (4, 4)."""
    xx, yy, zz = P[0, 0], P[1, 1], P[2, 2]
    return np.array(
        [P[3, 3], P[0, 3], P[1, 3], P[2, 3], yy + zz, -P[0, 1], -P[0, 2], xx + zz, -P[1, 2], xx + yy]
    )


def log_cholesky_from_linear(linear: Array) -> Array:
    """Inverse of :func:`linear_from_log_cholesky`.

    Raises ``numpy.linalg.LinAlgError`` where no body has these parameters.
    """
    about_datum = tensor(linear[4:])
    P = np.empty((4, 4))
    P[:3, :3] = 0.5 * np.trace(about_datum) * np.eye(3) - about_datum
    P[:3, 3] = P[3, :3] = linear[1:4]
    P[3, 3] = linear[0]
    flip = P[::-1, ::-1]
    U = np.linalg.cholesky(flip)[::-1, ::-1]
    a = np.log(U[3, 3])
    V = U / U[3, 3]
    return np.array(
        [
            a,
            np.log(V[0, 0]),
            np.log(V[1, 1]),
            np.log(V[2, 2]),
            V[0, 1],
            V[1, 2],
            V[0, 2],
            V[0, 3],
            V[1, 3],
            V[2, 3],
        ]
    )


def complex_step_jacobian(function, x: Array) -> Array:  # type: ignore[no-untyped-def]
    """Exact Jacobian of an analytic function by complex step; (len(function(x)), len(x))."""
    columns = []
    for i in range(x.size):
        shifted = x.astype(complex)
        shifted[i] += 1e-30j
        columns.append(np.imag(function(shifted)) / 1e-30)
    return np.stack(columns, axis=1)


def can_exist(elements: Array) -> bool:
    """Whether mass and inertia are those of some distribution of positive mass."""
    if not (np.all(np.isfinite(elements)) and elements[0] > 0.0):
        return False
    principal = np.linalg.eigvalsh(tensor(elements[4:]))
    return bool(principal[0] > 0.0 and principal[0] + principal[1] > principal[2])


def inertia_times(v: Array) -> Array:
    """(N, 3, 6): I v as a linear map of (xx, xy, xz, yy, yz, zz)."""
    out = np.zeros((v.shape[0], 3, 6))
    x, y, z = v.T
    out[:, 0, 0], out[:, 0, 1], out[:, 0, 2] = x, y, z
    out[:, 1, 1], out[:, 1, 3], out[:, 1, 4] = x, y, z
    out[:, 2, 2], out[:, 2, 4], out[:, 2, 5] = x, y, z
    return out
