"""The one-step predictor of thesis eq. 3.25 and the searches that fit it (eqs. 3.28 to 3.34)."""

from __future__ import annotations

import numpy as np
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
        self.rate, self.moment = rate[:-1], moment[:-1]
        self.change = rate[1:] - rate[:-1]
        self.sampling = sampling
        self.gyroscopic = gyroscopic

    def error(self, parameters: Array) -> Array | None:
        """(n - 1, 3) rad/s; None where J cannot be inverted."""
        return None if (parts := self._parts(parameters)) is None else parts[0]

    def error_and_slope(self, parameters: Array) -> tuple[Array, Array] | None:
        """Errors and their slopes (n - 1, 3, 6)."""
        parts = self._parts(parameters)
        if parts is None:
            return None
        error, inverse, acceleration = parts
        # d(J^-1 u) = -J^-1 dJ J^-1 u + J^-1 du, with du = -w x dJ w.
        slope = np.einsum("kij,nj->nik", ELEMENTS, acceleration)
        if self.gyroscopic:
            spin = np.einsum("kij,nj->nik", ELEMENTS, self.rate)
            slope = slope + np.cross(self.rate[:, :, None], spin, axisa=1, axisb=1, axisc=1)
        return error, self.sampling * (inverse @ slope)

    def _parts(self, parameters: Array) -> tuple[Array, Array, Array] | None:
        inertia = tensor(parameters)
        if not np.isfinite(inertia).all() or np.linalg.cond(inertia) > 1e12:
            return None
        inverse: Array = np.asarray(np.linalg.inv(inertia), dtype=float)
        drive = self.moment
        if self.gyroscopic:
            drive = drive - np.cross(self.rate, self.rate @ inertia)
        acceleration = drive @ inverse
        return self.change - self.sampling * acceleration, inverse, acceleration


def search_minimum(
    predictor: EulerPredictor, parameters: Array, weight: Array, search: str, limit: float
) -> tuple[Array, bool, int]:
    """Minimise the weighted sum of squares; returns parameters, whether settled, iterations."""
    damping = 1e-3
    for iteration in range(1, ITERATIONS + 1):
        parts = predictor.error_and_slope(parameters)
        if parts is None:
            return parameters, False, iteration
        error, slope = parts
        cost = _cost(error, weight)
        rows = slope.reshape(-1, 6)
        weighted = (weight @ slope).reshape(-1, 6)
        hessian = weighted.T @ rows
        gradient = weighted.T @ error.ravel()
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


def _cost(error: Array | None, weight: Array) -> float:
    return np.inf if error is None else float(np.sum((error @ weight) * error))


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
        if _cost(predictor.error(parameters + share * direction), weight) <= cost:
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
        if _cost(predictor.error(parameters + step), weight) <= cost:
            return step, max(damping / 10.0, 1e-15)
        damping *= 10.0
    return np.zeros(6), damping
