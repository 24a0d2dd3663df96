"""What the residuals of one channel look like beside white noise of the stated size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ResidualSummary:
    """Distribution, spectrum and autocorrelation of a residual in units of its noise."""

    mean: float  # sigma
    rms: float  # sigma; 1 is a perfect model
    beyond_3_sigma: float  # fraction of samples; 0.0027 for normal noise
    density_at: Array  # (bins,) sigma, centres
    density: Array  # (bins,) 1/sigma
    frequency: Array  # (f,) Hz, without zero
    power: Array  # (f,) against white noise of one sigma: 1 is a perfect model
    lag: Array  # (l,) s
    correlation: Array  # (l,)
    white_band: float  # 95 % of a white residual's correlations lie within plus or minus this

    @property
    def first_correlation(self) -> float:
        """Correlation of neighbouring samples: 0 for white noise."""
        return float(self.correlation[0]) if len(self.correlation) else 0.0


def summarise_residual(
    time: Array, residual: Array, *, longest_lag: float = 4.0, bins: int = 41
) -> ResidualSummary:
    """Summarise a residual.

    Parameters
    ----------
    time : (n,) array
        s. Taken as evenly spaced at its median interval: gaps blur spectrum and correlation a little.
    residual : (n,) array
        In units of the noise of one sample.
    longest_lag : float
        s, of the correlation; at most a quarter of the series.
    bins : int
        Of the histogram, within five standard deviations; what lies beyond counts in the outermost.
    """
    interval = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    span = 5.0
    counts, edges = np.histogram(np.clip(residual, -span, span), bins=bins, range=(-span, span))
    frequency, power = _spectrum(residual, interval)
    correlation = _correlation(residual, round(longest_lag / interval))
    return ResidualSummary(
        mean=float(np.mean(residual)),
        rms=float(np.sqrt(np.mean(np.square(residual)))),
        beyond_3_sigma=float(np.mean(np.abs(residual) > 3.0)),
        density_at=0.5 * (edges[1:] + edges[:-1]),
        density=counts / max(len(residual), 1) / (edges[1] - edges[0]),
        frequency=frequency,
        power=power,
        lag=interval * np.arange(1.0, len(correlation) + 1.0),
        correlation=correlation,
        white_band=1.96 / np.sqrt(max(len(residual), 1)),
    )


def _spectrum(residual: Array, interval: float) -> tuple[Array, Array]:
    """Welch's power density over that of white noise of one sigma, which is ``2 * interval``."""
    from scipy import signal  # takes most of a second: not where nothing was fitted

    if len(residual) < 16:
        return np.empty(0), np.empty(0)
    length = min(len(residual), max(16, min(4096, len(residual) // 4)))
    frequency, density = signal.welch(residual, fs=1.0 / interval, nperseg=length, detrend=False)
    inner = slice(1, -1)  # zero and the highest frequency are scaled otherwise
    return _log_average(frequency[inner], density[inner] / (2.0 * interval))


def _log_average(frequency: Array, power: Array, per_decade: int = 24) -> tuple[Array, Array]:
    """Means over equal stretches of the logarithm of frequency, so that the dense end stays legible."""
    stretch = np.floor(per_decade * np.log10(frequency / frequency[0]) + 1e-9).astype(int)
    _, index, count = np.unique(stretch, return_inverse=True, return_counts=True)
    return np.bincount(index, frequency) / count, np.bincount(index, power) / count


def _correlation(residual: Array, lags: int) -> Array:
    from scipy import signal

    centred = residual - np.mean(residual)
    power = float(centred @ centred)
    count = min(lags, len(residual) // 4)
    if power == 0.0 or count < 1:
        return np.empty(0)
    full = signal.correlate(centred, centred, mode="full", method="fft")
    return np.asarray(full[len(residual) : len(residual) + count] / power)
