"""A device that follows what it measures like a first-order low-pass, tau dy/dt + y = u.

Between nodes u is taken as a parabola, its second derivative that of the nodes about: with
    a = e^(-h/tau),   q = (1 - a) tau/h,   d_k = u_k-1 - 2 u_k + u_k+1
    y_k+1 = a y_k + (q - a) u_k + (1 - q) u_k+1 - g (d_k + d_k+1),
    g = 1/(4 h^2) times the integral of s (h - s) e^(-(h - s)/tau)/tau over the interval,
which is (h (tau - (h + tau) a) - 2 tau^2 + (h^2 + 2 h tau + 2 tau^2) a) / (4 h^2). A straight line
between nodes cuts the peaks of a swing at angular frequency w by (w h)^2/12, as much as a lag of half a
step does: a cell late by 5 ms was told as late by 3 and its clock by 2 (bench/concealed/sealed_run_29,
14962). The device has followed u before the first node as well, along the line that it begins with. To
first order the output is late by tau, and so it is continued to negative time constants, where a fit may
pass through.
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


def settling_cost(variance: Array, unsettled: Array) -> float:
    """Negative log likelihood (nats) of variance (g, w) ``unsettled`` beside noise of ``variance`` (g, w).

    What a device showed before the run is one unknown of each of its axes, e exp(-t/tau). Every sample that
    it touches is left out of the fit for the sake of that one. A sample that is left out takes its half
    square of noise and its log spread out of the cost. So both are put back, and one unknown costs the log of
    how much sharper than beforehand all samples together know it (Laplace).
    """
    share = unsettled / variance
    left_out = 0.5 * np.sum(share / (1.0 + share) - np.log1p(share))
    return float(left_out + 0.5 * np.sum(np.log1p(np.sum(share, axis=0))))


def lagged(step: float, tau: float, values: Array) -> Array:
    """What a device of time constant ``tau`` (s) shows of ``values`` (N, c), ``step`` seconds apart."""
    if tau == 0.0:
        return values
    if tau < 0.0:
        return np.asarray(values - tau * np.gradient(values, step, axis=0))
    a = float(np.exp(-step / tau))
    q = (1.0 - a) * tau / step
    bend = _bend(values)
    first = values[0] - tau * (values[1] - values[0] - 0.5 * bend[0]) / step
    curved = step * (tau - (step + tau) * a) - 2.0 * tau**2 + (step**2 + 2.0 * step * tau + 2.0 * tau**2) * a
    moved = (q - a) * values[:-1] + (1.0 - q) * values[1:] - curved / (4.0 * step**2) * (bend[:-1] + bend[1:])
    rest, _ = lfilter([1.0], [1.0, -a], moved, axis=0, zi=a * first[None])
    return np.concatenate([first[None], rest])


def _bend(values: Array) -> Array:
    """(N, c) second differences of ``values`` (N, c); at the ends those of their neighbours."""
    if values.shape[0] < 3:
        return np.zeros_like(values)
    inside = np.diff(values, 2, axis=0)
    return np.concatenate([inside[:1], inside, inside[-1:]])
