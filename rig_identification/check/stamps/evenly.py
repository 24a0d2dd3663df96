"""Whether a device measured evenly, whatever its stamps say: its values tell.

Stamps alone do not tell a device that is stamped late or early from one that measures unevenly. The values
do. A value measured at an even time t lies on the smooth motion y(t). One measured at its stamp, ``late``
after that, lies y'(t) late off it. So of the residuals about the smooth motion the part c that goes with
y'(t) late is 0 for even measurements and 1 for right stamps. Where a body hardly moves c is not known, and
the stamps do no harm.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_coeffs, savgol_filter

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Windows (samples) of cubic smoothing: the one with the least cross-validated error is taken.
_WINDOWS = (5, 9, 17, 33, 65, 129)
_CUBIC = 3
#: Missing samples in a row that are interpolated.
_MISSING = 1
#: The smooth motion's own errors, and the grid's: c is no better known than this.
_COEFFICIENT = 0.1
#: Samples over which residuals may be alike (Newey and West, Econometrica 55, 1987): smoothing leaves them
#: nearly white.
_ALIKE = 5


def measured_evenly(values: Array, late: Array, interval: float, index: Indices | None = None) -> float:
    """Nats for values of even times against values of the stamps' times.

    values: (n, width); late: (n,) s, stamp less even time; interval: s; index: (n,) intervals from the first
    sample to each, rising; without it none is missing.
    """
    count = np.arange(len(late)) if index is None else index - index[0]
    evidence = 0.0
    for column in values[:, np.isfinite(values).all(axis=0)].T:
        every = CubicSpline(count, column)(np.arange(count[-1] + 1))
        window = _window(every)
        if window is None:
            continue
        sound = _sound(count, window)
        velocity = savgol_filter(every, window, _CUBIC, deriv=1, delta=interval)
        due = np.zeros(len(every))
        due[count] = velocity[count] * (late - np.mean(late))
        # What smoothing leaves of it: stamps that lie on a lattice vary slowly
        due = (due - savgol_filter(due, window, _CUBIC))[count][sound]
        residual = (every - savgol_filter(every, window, _CUBIC))[count][sound]
        square = float(due @ due)
        if square == 0.0:
            continue
        part = float(due @ residual) / square
        std = math.hypot(_deviation((residual - part * due) * due) / square, _COEFFICIENT)
        evidence += 0.5 * ((1.0 - part) ** 2 - part**2) / std**2
    return evidence


def _window(values: Array) -> int | None:
    """Samples over which evenly spaced ``values`` (n,) are smoothed; None of fewer than any window.

    It has the least generalized cross-validated error (Craven and Wahba, Numer. Math. 31, 1979).
    """
    best, least = None, math.inf
    for window in _WINDOWS:
        if window > len(values):
            break
        own = float(savgol_coeffs(window, _CUBIC)[window // 2])
        residual = values - savgol_filter(values, window, _CUBIC)
        error = float(np.mean(residual**2)) / (1.0 - own) ** 2
        if error < least:
            best, least = window, error
    return best if least > 0.0 else None


def _sound(count: Indices, window: int) -> NDArray[np.bool_]:
    """(n,) samples about which no two in a row are missing, and that are no end of the record.

    One that is missing is interpolated as well as its neighbours are known. count: (n,) number of each.
    """
    half = window // 2
    holes = np.zeros(count[-1] + 2)
    for before, gap in zip(count[:-1], np.diff(count), strict=True):
        if gap > _MISSING + 1:
            holes[before + 1 : before + gap] = 1.0
    about = np.concatenate(([0.0], np.cumsum(holes)))
    low, high = count - half, count + half
    inside = (low >= 0) & (high <= count[-1])
    low, high = np.clip(low, 0, count[-1]), np.clip(high, 0, count[-1])
    return np.asarray(inside & (about[high + 1] == about[low]))


def _deviation(errors: Array) -> float:
    """Standard deviation of the sum of ``errors`` (n,), which may be alike over some samples."""
    alone = float(errors @ errors)
    shared = sum(2.0 * (1.0 - lag / _ALIKE) * float(errors[lag:] @ errors[:-lag]) for lag in range(1, _ALIKE))
    return math.sqrt(max(alone + shared, alone))
