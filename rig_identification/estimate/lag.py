"""A device that follows what it measures like a first-order low-pass, tau dy/dt + y = u.

Between nodes u is taken as linear, for which
    y_k+1 = a y_k + (q - a) u_k + (1 - q) u_k+1,   a = e^(-h/tau),   q = (1 - a) tau/h
is exact. The device has followed u before the first node as well, along the line through its
first two values. To first order the output is late by tau, and so it is continued to negative
time constants, where a fit may pass through.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]


#: How far a lagging device may be from its steady answer when a run starts, in std of what it shows.
UNSETTLED = 3.0


def unsettled(step: float, tau: float, node: NDArray[np.int64], values: Array) -> Array:
    """(g, w) variance that a device of time constant ``tau`` (s) brings from before the run.

    node (g,): node of each sample. values (g, w): samples. What it measured then is not known: a body
    that is let go jumps from one load to another.
    """
    if tau <= 0.0:
        return np.zeros_like(values)
    away = UNSETTLED * np.std(values, axis=0) * np.exp(-step * node / tau)[:, None]
    return np.asarray(away**2)


def lagged(step: float, tau: float, values: Array) -> Array:
    """What a device of time constant ``tau`` (s) shows of ``values`` (N, c), ``step`` seconds apart."""
    if tau == 0.0:
        return values
    if tau < 0.0:
        return np.asarray(values - tau * np.gradient(values, step, axis=0))
    a = float(np.exp(-step / tau))
    q = (1.0 - a) * tau / step
    first = values[0] - tau * (values[1] - values[0]) / step
    # lfilter's state carries (q - a) u_0 + a y_0 into the second output
    state = (a * first + (q - a) * values[0])[None]
    rest, _ = lfilter([1.0 - q, q - a], [1.0, -a], values[1:], axis=0, zi=state)
    return np.concatenate([first[None], rest])
