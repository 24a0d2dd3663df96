"""The one-step predictor of thesis eq. 3.25 and the searches that fit it (eqs. 3.28 to 3.34)."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: (6, 3, 3): the tensor is the sum of these, times the parameters.
ELEMENTS = np.array(
    [[[float({i, j} == {p, q}) for q in range(3)] for p in range(3)]
     for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
)  # fmt: skip
ITERATIONS = 200
SETTLED = 1e-12  # relative step at which a search ends
HALVINGS = 30  # of a line search (thesis eq. 3.34)


def tensor(parameters: Array) -> Array:
    """(3, 3) tensor of its six elements xx xy xz yy yz zz."""
    return np.asarray(np.einsum("k,kij->ij", parameters, ELEMENTS))


class EulerPredictor:
    """w_hat(n+1) = w(n) + T J^-1 (M(n) - g w(n) x J w(n)) as errors and slopes in the six parameters."""

    def __init__(self, rate: Array, moment: Array, sampling: float, gyroscopic: bool) -> None:
        self.rate, self.moment = np.ascontiguousarray(rate[:-1]), np.ascontiguousarray(moment[:-1])
        self.change = np.ascontiguousarray(rate[1:] - rate[:-1])
        self.sampling = sampling
        self.gyroscopic = gyroscopic

    def error(self, parameters: Array) -> Array | None:
        """(n - 1, 3) rad/s; None where J cannot be inverted."""
        return None if (parts := self._parts(parameters)) is None else parts[0]

    def cost(self, parameters: Array, weight: Array) -> float:
        """Weighted sum of squares; infinite where J cannot be inverted."""
        found = _inverted(parameters)
        return np.inf if found is None else float(self._sums(*found, weight, False)[0])

    def normal(self, parameters: Array, weight: Array) -> tuple[float, Array, Array] | None:
        """(weighted sum of squares, its Hessian after Gauss (6, 6), gradient (6,)), both halved."""
        found = _inverted(parameters)
        return None if found is None else self._sums(*found, weight, True)

    def _sums(
        self, inertia: Array, inverse: Array, weight: Array, slopes: bool
    ) -> tuple[float, Array, Array]:
        samples = (self.rate, self.moment, self.change, self.sampling)
        return sums_of_squares(  # type: ignore[no-any-return]
            inertia, inverse, *samples, self.gyroscopic, weight, slopes
        )

    def _parts(self, parameters: Array) -> tuple[Array, Array, Array] | None:
        found = _inverted(parameters)
        if found is None:
            return None
        inertia, inverse = found
        drive = self.moment
        if self.gyroscopic:
            drive = drive - np.cross(self.rate, self.rate @ inertia)
        acceleration = drive @ inverse
        return self.change - self.sampling * acceleration, inverse, acceleration


def _inverted(parameters: Array) -> tuple[Array, Array] | None:
    """(tensor, its inverse) (3, 3); None where there is none."""
    inertia = tensor(parameters)
    if not np.isfinite(inertia).all() or np.linalg.cond(inertia) > 1e12:
        return None
    return inertia, np.asarray(np.linalg.inv(inertia), dtype=float)


@njit(cache=True)
def sums_of_squares(  # type: ignore[no-untyped-def]
    inertia, inverse, rate, moment, change, sampling, gyroscopic, weight, slopes
):
    """(cost, Hessian (6, 6), gradient (6,)) of the predictor's errors, sample by sample."""
    cost, hessian, gradient = 0.0, np.zeros((6, 6)), np.zeros(6)
    slope, in_error, weighted = np.empty((3, 6)), np.empty((3, 6)), np.empty((3, 6))
    drive, turned, a, error, pull = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(rate.shape[0]):
        w = rate[n]
        drive[:] = moment[n]
        if gyroscopic:
            _times(inertia, w, turned)
            drive[0] -= w[1] * turned[2] - w[2] * turned[1]
            drive[1] -= w[2] * turned[0] - w[0] * turned[2]
            drive[2] -= w[0] * turned[1] - w[1] * turned[0]
        _times(inverse, drive, a)
        for i in range(3):
            error[i] = change[n, i] - sampling * a[i]
        _times(weight, error, pull)
        cost += error[0] * pull[0] + error[1] * pull[1] + error[2] * pull[2]
        if not slopes:
            continue
        # d(J^-1 u) = -J^-1 dJ J^-1 u + J^-1 du, with du = -w x dJ w.
        _element_times(a, slope)
        if gyroscopic:
            _element_times(w, weighted)
            for k in range(6):
                slope[0, k] += w[1] * weighted[2, k] - w[2] * weighted[1, k]
                slope[1, k] += w[2] * weighted[0, k] - w[0] * weighted[2, k]
                slope[2, k] += w[0] * weighted[1, k] - w[1] * weighted[0, k]
        for k in range(6):
            _times(inverse, slope[:, k], in_error[:, k])
            _times(weight, in_error[:, k], weighted[:, k])
            for i in range(3):
                in_error[i, k] *= sampling
                weighted[i, k] *= sampling
                gradient[k] += pull[i] * in_error[i, k]
        for k in range(6):
            for m in range(6):
                for i in range(3):
                    hessian[k, m] += weighted[i, k] * in_error[i, m]
    return cost, hessian, gradient


@njit(cache=True)
def _times(matrix, vector, out):  # type: ignore[no-untyped-def]
    """``out`` (3,) becomes ``matrix`` (3, 3) times ``vector`` (3,): a call of BLAS takes longer."""
    for i in range(3):
        out[i] = matrix[i, 0] * vector[0] + matrix[i, 1] * vector[1] + matrix[i, 2] * vector[2]


@njit(cache=True)
def _element_times(v, out):  # type: ignore[no-untyped-def]
    """Columns of ``out`` (3, 6): each of ELEMENTS times ``v``, in their order xx xy xz yy yz zz."""
    out[:] = 0.0
    out[0, 0] = v[0]
    out[0, 1], out[1, 1] = v[1], v[0]
    out[0, 2], out[2, 2] = v[2], v[0]
    out[1, 3] = v[1]
    out[1, 4], out[2, 4] = v[2], v[1]
    out[2, 5] = v[2]


def search_minimum(
    predictor: EulerPredictor, parameters: Array, weight: Array, search: str, limit: float
) -> tuple[Array, bool, int]:
    """Minimise the weighted sum of squares; returns parameters, whether settled, iterations."""
    damping = 1e-3
    for iteration in range(1, ITERATIONS + 1):
        parts = predictor.normal(parameters, weight)
        if parts is None:
            return parameters, False, iteration
        cost, hessian, gradient = parts
        if search == "levenberg_marquardt":
            found = _damped(predictor, parameters, weight, cost, hessian, gradient, damping)
        else:
            kept = limit if search == "regularized_gauss_newton" else 0.0
            found = _along(predictor, parameters, weight, cost, _direction(hessian, gradient, kept))
        step, damping = found[0], found[1] if search == "levenberg_marquardt" else damping
        parameters = parameters + step
        if np.abs(step).max() <= SETTLED * np.abs(parameters).max():
            return parameters, True, iteration
    return parameters, False, ITERATIONS


def _direction(hessian: Array, gradient: Array, limit: float) -> Array:
    """Gauss-Newton's step (eq. 3.33); eigenvalues below ``limit`` of the largest are left out."""
    values, vectors = np.linalg.eigh(hessian)
    kept = values > max(limit, 1e-15) * values[-1]
    return np.asarray(-vectors[:, kept] @ ((vectors[:, kept].T @ gradient) / values[kept]))


def _along(
    predictor: EulerPredictor, parameters: Array, weight: Array, cost: float, direction: Array
) -> tuple[Array, float]:
    """Halve the step until the cost is no larger (eq. 3.34)."""
    share = 1.0
    for _ in range(HALVINGS):
        if predictor.cost(parameters + share * direction, weight) <= cost:
            return share * direction, share
        share *= 0.5
    return np.zeros_like(direction), share


def _damped(
    predictor: EulerPredictor,
    parameters: Array,
    weight: Array,
    cost: float,
    hessian: Array,
    gradient: Array,
    damping: float,
) -> tuple[Array, float]:
    """Raise the damping until the cost is no larger, then lower it for the next step (eq. 3.30)."""
    scale = np.diag(np.diag(hessian))
    for _ in range(HALVINGS):
        step = np.asarray(-np.linalg.solve(hessian + damping * scale, gradient), dtype=float)
        if predictor.cost(parameters + step, weight) <= cost:
            return step, max(damping / 10.0, 1e-15)
        damping *= 10.0
    return np.zeros(6), damping
