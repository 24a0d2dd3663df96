"""The thesis' own estimator, and two steps away from it.

Newton-Euler about the centre of mass in body axes (Kutluay eq. 3.10, with the gyroscopic term
that the thesis leaves out):

    J w' + w x J w = M                                                              (i)

The predictor of eq. 3.25 with the rates as measured outputs is one Euler step,

    w_hat(n+1) = w(n) + T J^-1 (M(n) - g w(n) x J w(n)),   g = 0 (thesis) or 1       (ii)

and the cost of eq. 3.14 is the squared distance of w(n+1) from it. The translational half of
eq. 3.11 holds no unknown. MATLAB's ``pem`` minimises, for several outputs, the determinant of
the errors' covariance rather than their plain sum of squares (Ljung, System Identification,
section 15.2); ``criterion="determinant"`` does so, and it is what gives back the thesis'
off-diagonal errors. (iii), the momentum form, integrates (i) over windows and so differentiates
nothing. A typing error of eq. 3.11, row 10 (A3 where A2 must stand), is not followed: the
inverse of J is.

Everything here works on arrays; J is (3, 3) kg m^2 with its elements as in a tensor, and the
parameters are ordered xx xy xz yy yz zz as in the thesis' initial guess vectors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_simpson

from rig_identification.errors import InputError

Array = NDArray[np.float64]

SEARCHES = ("gauss_newton", "levenberg_marquardt", "regularized_gauss_newton")
CRITERIA = ("sum", "determinant")
#: (6, 3, 3): the tensor is the sum of these, times the parameters.
ELEMENTS = np.array(
    [[[float({i, j} == {p, q}) for q in range(3)] for p in range(3)]
     for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))]
)  # fmt: skip
ITERATIONS = 200
SETTLED = 1e-12  # relative step at which a search ends
HALVINGS = 30  # of a line search (thesis eq. 3.34)


@dataclass(frozen=True)
class InertiaFit:
    """What a search ended with; not converging is a result, not an exception."""

    inertia: Array  # (3, 3) kg m^2
    converged: bool
    iterations: int
    cost: float  # of the criterion, per sample
    residual_std: Array  # (3,) of the predicted outputs: rad/s, or N m s for the momentum form


def fit_euler_predictor(
    rate: Array,
    moment: Array,
    sampling: float,
    initial_inertia: Array,
    *,
    gyroscopic: bool = False,
    search: str = "gauss_newton",
    criterion: str = "determinant",
    eigenvalue_limit: float = 1e-8,
) -> InertiaFit:
    """Fit J to the one-step predictor (ii) from a first guess.

    ``rate`` (n, 3) rad/s and ``moment`` (n, 3) N m about the centre of mass are in body axes,
    ``sampling`` in s. ``search``: Gauss-Newton with line search (eq. 3.34), Levenberg-Marquardt
    (eq. 3.30), or the regularised Gauss-Newton that leaves out directions in which the Hessian's
    eigenvalue is below ``eigenvalue_limit`` times the largest. Raises ``InputError`` for arrays
    that do not fit together and for unknown names.
    """
    rate, moment = _checked(rate, moment, sampling)
    if search not in SEARCHES:
        raise InputError(f"search {search!r} is unknown; choose one of {', '.join(SEARCHES)}")
    if criterion not in CRITERIA:
        raise InputError(f"criterion {criterion!r} is unknown; choose one of {', '.join(CRITERIA)}")
    predictor = _Predictor(rate, moment, sampling, gyroscopic)
    parameters = np.einsum("kij,ij->k", ELEMENTS, initial_inertia) / np.einsum(
        "kij,kij->k", ELEMENTS, ELEMENTS
    )
    weight = np.eye(3)
    converged, iterations = False, 0
    # Minimising the determinant equals weighting by the errors' inverse covariance, again and again.
    for _ in range(1 if criterion == "sum" else 20):
        before = parameters
        parameters, converged, used = _search(predictor, parameters, weight, search, eigenvalue_limit)
        iterations += used
        error = predictor.error(parameters)
        if error is None or not converged or criterion == "sum":
            break
        covariance = error.T @ error / len(error)
        if np.linalg.cond(covariance) > 1e12:
            break  # an axis without error: its determinant has no minimum
        weight = np.linalg.inv(covariance)
        if np.abs(parameters - before).max() <= 1e-9 * np.abs(parameters).max():
            break
    return _fit(predictor, parameters, converged, iterations, criterion)


def fit_momentum(
    rate: Array, moment: Array, sampling: float, *, gyroscopic: bool = True, window: float = 0.5
) -> InertiaFit:
    """Regress J on (i) integrated over windows of ``window`` seconds that overlap by all but a sample:

        [J w] + integral of w x J w = integral of M                                 (iii)

    which is linear in J: no guess, no search. Arrays as in :func:`fit_euler_predictor`; integrals
    by Simpson's rule. Where the moment jumps between two samples its integral is off by up to half
    a sample's worth.
    """
    rate, moment = _checked(rate, moment, sampling)
    steps = max(2, round(window / sampling))
    if len(rate) <= steps + 6:
        raise InputError(
            f"momentum regression: {len(rate)} samples for windows of {steps}; record longer or shorten it"
        )
    columns = np.einsum("kij,nj->nik", ELEMENTS, rate)
    if gyroscopic:
        turning = np.cross(rate[:, :, None], columns, axisa=1, axisb=1, axisc=1)
        columns = columns + _integral(turning, sampling)
    impulse = _integral(moment, sampling)
    regressor = (columns[steps:] - columns[:-steps]).reshape(-1, 6)
    side = (impulse[steps:] - impulse[:-steps]).ravel()
    parameters, _, rank, _ = np.linalg.lstsq(regressor, side, rcond=None)
    error = (side - regressor @ parameters).reshape(-1, 3)
    return InertiaFit(
        inertia=tensor(parameters),
        converged=bool(rank == 6),
        iterations=1,
        cost=float(np.mean(np.sum(error**2, axis=1))),
        residual_std=error.std(axis=0),
    )


def tensor(parameters: Array) -> Array:
    """(3, 3) tensor of its six elements xx xy xz yy yz zz."""
    return np.asarray(np.einsum("k,kij->ij", parameters, ELEMENTS))


def _checked(rate: Array, moment: Array, sampling: float) -> tuple[Array, Array]:
    rate, moment = np.asarray(rate, dtype=float), np.asarray(moment, dtype=float)
    if rate.ndim != 2 or rate.shape[1] != 3 or rate.shape != moment.shape:
        raise InputError(f"rate {rate.shape} and moment {moment.shape}: both must be (n, 3) with the same n")
    if len(rate) < 8:
        raise InputError(f"rate: {len(rate)} samples cannot tell six elements; give at least 8")
    if not (np.isfinite(rate).all() and np.isfinite(moment).all()):
        raise InputError("rate or moment: not every sample is a number; leave the gaps out")
    if not sampling > 0.0:
        raise InputError(f"sampling {sampling!r} s: it must be positive")
    return rate, moment


def _integral(values: Array, sampling: float) -> Array:
    return np.asarray(cumulative_simpson(values, dx=sampling, axis=0, initial=0))


class _Predictor:
    """Equation (ii) as errors and slopes in the six parameters."""

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


def _search(
    predictor: _Predictor, parameters: Array, weight: Array, search: str, limit: float
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
    predictor: _Predictor, parameters: Array, weight: Array, cost: float, direction: Array
) -> tuple[Array, float]:
    """Halve the step until the cost is no larger (eq. 3.34)."""
    share = 1.0
    for _ in range(HALVINGS):
        if _cost(predictor.error(parameters + share * direction), weight) <= cost:
            return share * direction, share
        share *= 0.5
    return np.zeros_like(direction), share


def _damped(
    predictor: _Predictor,
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


def _fit(
    predictor: _Predictor, parameters: Array, converged: bool, iterations: int, criterion: str
) -> InertiaFit:
    error = predictor.error(parameters)
    if error is None:
        return InertiaFit(tensor(parameters), False, iterations, float("inf"), np.full(3, np.inf))
    covariance = error.T @ error / len(error)
    cost = float(np.trace(covariance) if criterion == "sum" else np.linalg.det(covariance))
    return InertiaFit(tensor(parameters), converged, iterations, cost, error.std(axis=0))
