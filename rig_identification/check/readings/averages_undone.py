"""The readings before a running average: a smooth signal first, then the noise, as far as the averages tell.

With A the average, y = A x + rounding. At the nulls of the average y says nothing of x, and a strong signal
beside a null leaks into them in a finite recording. So the signal is fitted as a spline of few
coefficients, which is far from the nulls in all but a few of them; what is left is noise, for which the
least x is right.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded
from scipy.sparse import csr_matrix, diags

from rig_identification.check.readings.channel_model import Array

#: Knots a window, at least this many samples apart: motion up to two and a half cycles a window.
_KNOTS, _APART = 6, 4
#: Stiffness of the spline against the averages' weight: the stiffest that leaves as little as the softest.
_STIFF = 10.0 ** np.arange(4.0, -9.0, -1.0)
_AS_LITTLE = 1.3
#: Conjugate gradients stop when the residual, which is noise, has fallen to this share.
_SMALL = 1e-3


def undone(column: Array, samples: int, floor: float) -> Array:
    """(n,) the readings before an average over the last ``samples``; the windows at the ends are poor.

    Parameters
    ----------
    column : (n,)
        Averaged readings at even intervals, finite.
    samples : int
        Readings of one average.
    floor : float
        Variance of the rounding over that of the noise before the average.
    """
    begun = samples - 1  # readings before the first one that its average takes
    signal = _smooth(column, samples)
    left = column - averaged(signal, samples)
    return np.asarray((signal + _least(left, samples, floor))[begun:])


def _smooth(column: Array, samples: int) -> Array:
    """(n + samples - 1,) the spline whose averages are near the column, the stiffest that comes so near."""
    apart = max(_APART, samples // _KNOTS)
    length = len(column) + samples - 1
    template = _bell(np.arange(1, 4 * apart) / apart)
    seen = np.convolve(template, np.full(samples, 1.0 / samples))
    starts = np.arange(-4 * apart + 1, length, apart)
    basis = _shifted(template, starts, length)
    watched = _shifted(seen, starts - samples + 1, len(column))
    level = float(np.mean(column))
    normal, right = (watched.T @ watched).tocsr(), watched.T @ (column - level)
    bend = diags([1.0, -4.0, 6.0, -4.0, 1.0], [0, 1, 2, 3, 4], shape=(len(starts) - 4, len(starts)))
    stiffness = (bend.T @ bend).tocsr()
    tried: list[tuple[float, Array]] = []
    for weight in _STIFF:
        matrix = normal + weight * stiffness + 1e-9 * diags(np.ones(len(starts)))
        coefficients = solveh_banded(_banded(matrix), right, lower=True)
        tried.append((float(np.sum((column - level - watched @ coefficients) ** 2)), coefficients))
    softest = min(error for error, _ in tried)
    chosen = next(coefficients for error, coefficients in tried if error <= _AS_LITTLE * softest)
    return np.asarray(basis @ chosen + level)


def _bell(x: Array) -> Array:
    """The cubic B-spline of the knots 0, 1, 2, 3 and 4, by its truncated powers."""
    powers = np.maximum(x[:, None] - np.arange(5.0), 0.0) ** 3
    return np.asarray(powers @ np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0)


def _shifted(template: Array, starts: np.ndarray, length: int) -> csr_matrix:
    """(length, k) whose columns are ``template`` from each of ``starts`` on, cut at both ends."""
    rows = starts[None, :] + np.arange(len(template))[:, None]
    columns = np.broadcast_to(np.arange(len(starts)), rows.shape)
    values = np.broadcast_to(template[:, None], rows.shape)
    inside = (rows >= 0) & (rows < length)
    return csr_matrix((values[inside], (rows[inside], columns[inside])), shape=(length, len(starts)))


def _banded(matrix: csr_matrix) -> Array:
    """Lower bands of a symmetric matrix, as scipy.linalg.solveh_banded takes them."""
    entries = matrix.tocoo()
    below = entries.row - entries.col
    out = np.zeros((int(below.max()) + 1, matrix.shape[0]))
    lower = below >= 0
    out[below[lower], entries.col[lower]] = entries.data[lower]
    return out


def _least(column: Array, samples: int, floor: float) -> Array:
    """A^T (A A^T + floor)^-1 y: the least white noise that averages to y to within the rounding."""
    # Two averages k samples apart share samples - k of their readings
    shared = (samples - np.arange(samples)) / samples**2
    bands = np.repeat(shared[:, None], len(column), axis=1)
    bands[0] += floor
    return spread(solveh_banded(bands, column, lower=True), samples)


def averaged(column: Array, samples: int) -> Array:
    """A x: means over windows, shorter by a window less one."""
    total = np.concatenate(([0.0], np.cumsum(column - column[0])))
    return np.asarray((total[samples:] - total[:-samples]) / samples + column[0])


def spread(column: Array, samples: int) -> Array:
    """A^T y, longer by a window less one."""
    padding = np.zeros(samples)
    total = np.cumsum(np.concatenate((padding, column, padding[1:])))
    return np.asarray((total[samples - 1 :] - np.concatenate(([0.0], total))[:-samples])[1:] / samples)
