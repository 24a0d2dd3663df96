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
from rig_identification.thesis.predictor import ELEMENTS, SEARCHES, EulerPredictor, tensor

Array = NDArray[np.float64]

CRITERIA = ("sum", "determinant")


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
    predictor = EulerPredictor(rate, moment, sampling, gyroscopic)
    parameters = np.einsum("kij,ij->k", ELEMENTS, initial_inertia) / np.einsum(
        "kij,kij->k", ELEMENTS, ELEMENTS
    )
    parameters, converged, iterations = predictor.minimise(
        parameters, search, eigenvalue_limit, criterion == "determinant"
    )
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


def _fit(
    predictor: EulerPredictor, parameters: Array, converged: bool, iterations: int, criterion: str
) -> InertiaFit:
    error = predictor.error(parameters)
    if error is None:
        return InertiaFit(tensor(parameters), False, iterations, float("inf"), np.full(3, np.inf))
    covariance = error.T @ error / len(error)
    cost = float(np.trace(covariance) if criterion == "sum" else np.linalg.det(covariance))
    return InertiaFit(tensor(parameters), converged, iterations, cost, error.std(axis=0))
