"""Arithmetic that carries a first-order derivative in the imaginary part.

The model's equations are written once, for real and for complex arrays alike. With an
imaginary part of ``STEP`` = 1e-30 on one input, the imaginary part of every result is
``STEP`` times its exact derivative (complex-step method: Squire & Trapp, SIAM Review 40,
1998): no difference of nearly equal numbers is ever taken, so the derivative is as exact
as the function. The reciprocal and the root are written for this use: they keep the
first order only, which costs a third of a full complex division.
"""

from __future__ import annotations

import math

from numba import njit, types
from numba.extending import overload

#: Imaginary step: its square underflows against 1, so second-order terms vanish.
STEP = 1e-30


def reciprocal(x):  # type: ignore[no-untyped-def]
    """1 / x, to first order in the imaginary part."""
    return 1.0 / x


def root(x):  # type: ignore[no-untyped-def]
    """Square root of x, to first order in the imaginary part."""
    return x**0.5


def magnitude(x):  # type: ignore[no-untyped-def]
    """Absolute value of x's real part, with the derivative's sign."""
    return x if x.real >= 0.0 else -x


@overload(reciprocal, inline="always")
def _reciprocal(x):  # type: ignore[no-untyped-def]
    if isinstance(x, types.Complex):

        def implementation(x):  # type: ignore[no-untyped-def]
            inverse = 1.0 / x.real
            return complex(inverse, -x.imag * inverse * inverse)

    else:

        def implementation(x):  # type: ignore[no-untyped-def]
            return 1.0 / x

    return implementation


@overload(root, inline="always")
def _root(x):  # type: ignore[no-untyped-def]
    if isinstance(x, types.Complex):

        def implementation(x):  # type: ignore[no-untyped-def]
            value = math.sqrt(x.real)
            return complex(value, 0.5 * x.imag / value)

    else:

        def implementation(x):  # type: ignore[no-untyped-def]
            return math.sqrt(x)

    return implementation


@overload(magnitude, inline="always")
def _magnitude(x):  # type: ignore[no-untyped-def]
    def implementation(x):  # type: ignore[no-untyped-def]
        return x if x.real >= 0.0 else -x

    return implementation


@njit(cache=True, inline="always")
def cross_into(out, ax, ay, az, bx, by, bz):  # type: ignore[no-untyped-def]
    """out = a x b."""
    out[0] = ay * bz - az * by
    out[1] = az * bx - ax * bz
    out[2] = ax * by - ay * bx


@njit(cache=True)
def invert(matrix, inverse):  # type: ignore[no-untyped-def]
    """Inverse of a small square matrix by Gauss-Jordan elimination with partial pivoting.

    ``matrix`` (n, n) is destroyed. Returns False where a pivot vanishes (singular).
    """
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            inverse[i, j] = 1.0 if i == j else 0.0
    for k in range(n):
        pivot = k
        largest = abs(matrix[k, k])
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > largest:
                largest = abs(matrix[i, k])
                pivot = i
        if not largest > 1e-14:
            return False
        if pivot != k:
            for j in range(n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
                inverse[k, j], inverse[pivot, j] = inverse[pivot, j], inverse[k, j]
        scale = 1.0 / matrix[k, k]
        for j in range(n):
            matrix[k, j] *= scale
            inverse[k, j] *= scale
        for i in range(n):
            if i != k:
                factor = matrix[i, k]
                if factor != 0.0:
                    for j in range(n):
                        matrix[i, j] -= factor * matrix[k, j]
                        inverse[i, j] -= factor * inverse[k, j]
    return True


@njit(cache=True)
def eliminate(matrix, vector):  # type: ignore[no-untyped-def]
    """Solve matrix x = vector in place (x in ``vector``) by Gaussian elimination with partial pivoting.

    Returns False where a pivot vanishes (singular).
    """
    n = matrix.shape[0]
    for k in range(n):
        pivot = k
        largest = abs(matrix[k, k])
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > largest:
                largest = abs(matrix[i, k])
                pivot = i
        if not largest > 1e-14:
            return False
        if pivot != k:
            for j in range(k, n):
                matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
            vector[k], vector[pivot] = vector[pivot], vector[k]
        scale = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * scale
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                vector[i] -= factor * vector[k]
    for k in range(n - 1, -1, -1):
        total = vector[k]
        for j in range(k + 1, n):
            total -= matrix[k, j] * vector[j]
        vector[k] = total / matrix[k, k]
    return True
