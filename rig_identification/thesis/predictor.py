"""The one-step predictor of thesis eq. 3.25 and the searches that fit it (eqs. 3.28 to 3.34).

At given J its error is linear in what a sample holds: change of rate, moment, and the gyroscopic
moment of each element of J. An orthogonal triangulation of all samples therefore leaves at most
24 rows that have the same sum of squares, and the same derivatives of it, at every J: the searches
work on these, however long the recording was.
"""

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
REWEIGHTED, UNCHANGED = 20, 1e-9  # rounds of a determinant's search, and the relative step that ends them
INVERTIBLE = 1e12  # condition number beyond which a matrix has no inverse to speak of
SEARCHES = ("gauss_newton", "levenberg_marquardt", "regularized_gauss_newton")


def tensor(parameters: Array) -> Array:
    """(3, 3) tensor of its six elements xx xy xz yy yz zz."""
    return np.asarray(np.einsum("k,kij->ij", parameters, ELEMENTS))


class EulerPredictor:
    """w_hat(n+1) = w(n) + T J^-1 (M(n) - g w(n) x J w(n)) as errors, and the J that makes them least."""

    def __init__(self, rate: Array, moment: Array, sampling: float, gyroscopic: bool) -> None:
        self.sampling, self.samples = sampling, len(rate) - 1
        now, parts = rate[:-1], [rate[1:] - rate[:-1], moment[:-1]]
        if gyroscopic:
            columns = np.einsum("kij,nj->nik", ELEMENTS, now)
            turning = np.cross(now[:, :, None], columns, axisa=1, axisb=1, axisc=1)
            parts.append(turning.reshape(self.samples, 18))
        self._all = np.concatenate(parts, axis=1)
        self._rows = np.asarray(np.linalg.qr(self._all, mode="r"), dtype=float)

    def error(self, parameters: Array) -> Array | None:
        """(n - 1, 3) rad/s; None where J cannot be inverted."""
        known, inverse = _inverted(tensor(parameters))
        if not known:
            return None
        change, moment, turning = _parts(self._all)
        return np.asarray(change - self.sampling * (moment - turning @ parameters) @ inverse)

    def minimise(
        self, parameters: Array, search: str, limit: float, determinant: bool
    ) -> tuple[Array, bool, int]:
        """(parameters (6,), whether settled, iterations) of least errors; search: one of SEARCHES."""
        found, settled, iterations = _minimised(
            *_parts(self._rows),
            self.samples,
            self.sampling,
            np.array(parameters, dtype=float),
            SEARCHES.index(search),
            limit,
            determinant,
        )
        return found, bool(settled), int(iterations)


def _parts(rows: Array) -> tuple[Array, Array, Array]:
    """Change of rate (n, 3), moment (n, 3), gyroscopic moment of each element (n, 3, 6); (n, 3, 0): none."""
    parts = rows[:, :3], rows[:, 3:6], rows[:, 6:].reshape(len(rows), 3, -1)
    if rows.shape[1] == 6:
        parts = *parts[:2], np.zeros((len(rows), 3, 6))
    change, moment, turning = (np.ascontiguousarray(part) for part in parts)
    return change, moment, turning


@njit(cache=True)
def _minimised(  # type: ignore[no-untyped-def]
    change, moment, turning, samples, sampling, parameters, search, limit, determinant
):
    """See :meth:`EulerPredictor.minimise`.

    Minimising the determinant equals weighting by the errors' inverse covariance, again and again.
    """
    rows = (change, moment, turning, sampling)
    weight, settled, iterations = np.eye(3), False, 0
    for _ in range(REWEIGHTED if determinant else 1):
        before = parameters
        parameters, settled, used = _search(rows, parameters, weight, search, limit)
        iterations += used
        if not determinant or not settled:
            break
        known, inverse = _inverted(_tensor(parameters))
        if not known:
            break
        # An axis without error: the determinant has no minimum
        told, weight = _inverted(_squares(rows, parameters, inverse) / samples)
        if not told or np.abs(parameters - before).max() <= UNCHANGED * np.abs(parameters).max():
            break
    return parameters, settled, iterations


@njit(cache=True)
def _search(rows, parameters, weight, search, limit):  # type: ignore[no-untyped-def]
    """Minimise the weighted sum of squares; (parameters, whether settled, iterations)."""
    damping = 1e-3
    for iteration in range(1, ITERATIONS + 1):
        known, inverse = _inverted(_tensor(parameters))
        if not known:
            return parameters, False, iteration
        cost, hessian, gradient = _sums(rows, parameters, inverse, weight, True)
        if search == 1:
            step, damping = _damped(rows, parameters, weight, cost, hessian, gradient, damping)
        else:
            kept = limit if search == 2 else 0.0
            step = _along(rows, parameters, weight, cost, _direction(hessian, gradient, kept))
        parameters = parameters + step
        if np.abs(step).max() <= SETTLED * np.abs(parameters).max():
            return parameters, True, iteration
    return parameters, False, ITERATIONS


@njit(cache=True)
def _direction(hessian, gradient, limit):  # type: ignore[no-untyped-def]
    """Gauss-Newton's step (eq. 3.33); eigenvalues below ``limit`` of the largest are left out."""
    values, vectors = np.linalg.eigh(hessian)
    step = np.zeros(6)
    for k in range(6):
        if values[k] > max(limit, 1e-15) * values[5]:
            along = 0.0
            for i in range(6):
                along += vectors[i, k] * gradient[i]
            for i in range(6):
                step[i] -= vectors[i, k] * along / values[k]
    return step


@njit(cache=True)
def _along(rows, parameters, weight, cost, direction):  # type: ignore[no-untyped-def]
    """Halve the step until the cost is no larger (eq. 3.34)."""
    share = 1.0
    for _ in range(HALVINGS):
        if _cost(rows, parameters + share * direction, weight) <= cost:
            return share * direction
        share *= 0.5
    return np.zeros(6)


@njit(cache=True)
def _damped(rows, parameters, weight, cost, hessian, gradient, damping):  # type: ignore[no-untyped-def]
    """Raise the damping until the cost is no larger, then lower it for the next step (eq. 3.30)."""
    scale = np.diag(hessian)
    if not scale.max() > 0.0:
        return np.zeros(6), damping
    # What no sample tells is held by its damping alone
    scale = np.diag(np.maximum(scale, 1e-15 * scale.max()))
    for _ in range(HALVINGS):
        step = -np.linalg.solve(hessian + damping * scale, gradient)
        if _cost(rows, parameters + step, weight) <= cost:
            return step, max(damping / 10.0, 1e-15)
        damping *= 10.0
    return np.zeros(6), damping


@njit(cache=True)
def _cost(rows, parameters, weight):  # type: ignore[no-untyped-def]
    """Weighted sum of squares; infinite where J cannot be inverted."""
    known, inverse = _inverted(_tensor(parameters))
    return _sums(rows, parameters, inverse, weight, False)[0] if known else np.inf


@njit(cache=True)
def _tensor(parameters):  # type: ignore[no-untyped-def]
    """(3, 3) of xx xy xz yy yz zz."""
    out = np.empty((3, 3))
    out[0, 0], out[1, 1], out[2, 2] = parameters[0], parameters[3], parameters[5]
    out[0, 1] = out[1, 0] = parameters[1]
    out[0, 2] = out[2, 0] = parameters[2]
    out[1, 2] = out[2, 1] = parameters[4]
    return out


@njit(cache=True)
def _inverted(matrix):  # type: ignore[no-untyped-def]
    """(whether it can be inverted, the inverse) of a symmetric (3, 3), by its cofactors."""
    out = np.empty((3, 3))
    for i in range(3):
        p, q = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            r, s = (j + 1) % 3, (j + 2) % 3
            out[j, i] = matrix[p, r] * matrix[q, s] - matrix[p, s] * matrix[q, r]
    determinant = matrix[0, 0] * out[0, 0] + matrix[0, 1] * out[1, 0] + matrix[0, 2] * out[2, 0]
    size = np.sqrt(np.sum(matrix**2) * np.sum(out**2))
    # The norms' product over the determinant is the condition number, NaN and infinity included
    if not size < INVERTIBLE * abs(determinant):
        return False, out
    return True, out / determinant


@njit(cache=True)
def _error(rows, n, parameters, inverse, a, error):  # type: ignore[no-untyped-def]
    """Angular acceleration that the predictor sees at row n, and its error, into ``a`` and ``error`` (3,)."""
    change, moment, turning, sampling = rows
    drive = np.empty(3)
    for i in range(3):
        drive[i] = moment[n, i]
        for k in range(6):
            drive[i] -= turning[n, i, k] * parameters[k]
    _times(inverse, drive, a)
    for i in range(3):
        error[i] = change[n, i] - sampling * a[i]


@njit(cache=True)
def _squares(rows, parameters, inverse):  # type: ignore[no-untyped-def]
    """(3, 3) sum of the errors' products."""
    out, a, error = np.zeros((3, 3)), np.empty(3), np.empty(3)
    for n in range(rows[0].shape[0]):
        _error(rows, n, parameters, inverse, a, error)
        for i in range(3):
            for j in range(3):
                out[i, j] += error[i] * error[j]
    return out


@njit(cache=True)
def _sums(rows, parameters, inverse, weight, slopes):  # type: ignore[no-untyped-def]
    """(cost, its Hessian after Gauss (6, 6), gradient (6,)), row by row; both derivatives halved."""
    cost, hessian, gradient = 0.0, np.zeros((6, 6)), np.zeros(6)
    slope, in_error, weighted = np.empty((3, 6)), np.empty((3, 6)), np.empty((3, 6))
    a, error, pull = np.empty(3), np.empty(3), np.empty(3)
    turning, sampling = rows[2], rows[3]
    for n in range(turning.shape[0]):
        _error(rows, n, parameters, inverse, a, error)
        _times(weight, error, pull)
        cost += error[0] * pull[0] + error[1] * pull[1] + error[2] * pull[2]
        if not slopes:
            continue
        # d(J^-1 u) = -J^-1 dJ J^-1 u + J^-1 du
        _element_times(a, slope)
        for k in range(6):
            for i in range(3):
                slope[i, k] += turning[n, i, k]
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
