"""Is a residual noise? Band power of its periodogram against what its noise has.

Under the model the whitened residuals of a channel are independent with unit variance, so each
ordinate of the normalised periodogram is exponential with mean one (Brockwell & Davis,
"Time Series: Theory and Methods", prop. 10.2.1) and the sum over a band of m ordinates is
Gamma(m). The level is taken from the series itself where it is above one: a sensor noisier than described is
white all the same. Where it is below, less is left than the model expects (of a slowly sampled force's error,
say, at frequencies that it does not have), which is nothing against the model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import gamma

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Band:
    """Power of one residual in one frequency band."""

    low: float  # Hz
    high: float  # Hz
    power: float  # mean ordinate; white noise has 1
    log10_p: float  # log10 of the probability that white noise has as much


def bands(residual: Array, rate: float, noise: Callable[[Array], Array] | None = None) -> list[Band]:
    """Power of ``residual`` (n,), sampled at ``rate`` Hz, in bands that double in width from low to high.

    noise: its power at frequencies (n,) Hz, in that of white noise; none: it is white.
    """
    n = residual.size
    if n < 64:
        return []
    spectrum = np.abs(np.fft.rfft(residual - np.mean(residual))) ** 2 / n
    ordinates = spectrum[1 : (n - 1) // 2 + 1]
    if noise is not None:
        ordinates = ordinates / noise(np.arange(1, ordinates.size + 1) * rate / n)
    # The median ordinate of white noise is ln 2 times the mean one; lines do not move it
    typical = float(np.median(ordinates)) / np.log(2.0)
    if not typical > 0.0:
        return []
    level = max(1.0, typical)
    out, first, width = [], 0, 4
    while first < ordinates.size:
        last = min(first + width, ordinates.size)
        count = last - first
        power = float(np.sum(ordinates[first:last])) / level
        # The level itself is known to about 1.5 / sqrt(number of ordinates)
        slack = 1.0 + 3.0 * 1.44 / np.sqrt(ordinates.size)
        log_p = float(gamma.logsf(power / slack, count)) / np.log(10.0)
        out.append(Band((first + 1) * rate / n, last * rate / n, power / count, log_p))
        first, width = last, width * 2
    return out
