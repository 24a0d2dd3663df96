"""Long series made short enough for a picture without losing a peak."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def envelope(time: Array, values: Array, columns: int) -> tuple[Array, Array]:
    """Keep the lowest and the highest sample of each of ``columns`` equal stretches of time.

    Parameters
    ----------
    time : (n,) array
        Increasing, s.
    values : (n,) array
    columns : int
        Stretches; the answer has at most two samples for each.

    Returns
    -------
    (m,) array, (m,) array
        A subset of the samples in their order, all of them where ``n <= 2 * columns``.
    """
    if len(time) <= 2 * columns:
        return time, values
    edges = np.linspace(time[0], time[-1], columns + 1)[:-1]
    start = np.unique(np.searchsorted(time, edges))
    length = np.diff(np.append(start, len(time)))
    column = np.repeat(np.arange(len(start)), length)
    order = np.lexsort((values, column))  # within a column from the lowest to the highest
    keep = np.unique(np.concatenate([order[start], order[start + length - 1]]))
    return time[keep], values[keep]


def worst_stretch(time: Array, residual: Array, width: float) -> tuple[float, float]:
    """Find the stretch of ``width`` seconds in which the residual is largest in the root mean square.

    Returns
    -------
    float, float
        Its start and end, s, inside the series.
    """
    if time[-1] - time[0] <= width:
        return float(time[0]), float(time[-1])
    power = np.append(0.0, np.cumsum(np.square(residual)))
    end = np.searchsorted(time, time + width)
    candidates = np.flatnonzero(time + width <= time[-1])
    gain = power[end[candidates]] - power[candidates]
    start = float(time[candidates[np.argmax(gain)]])
    return start, start + width
