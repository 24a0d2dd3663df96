"""The trace that a running average over ``samples`` readings leaves in the spectrum of white noise.

The average multiplies the spectrum by D(f)^2, D = sin(pi f M) / (M sin(pi f)), f in cycles a sample: zero
at every multiple of 1/M. In the cepstrum (the Fourier series of the spectrum's logarithm) log |1 - exp(-i w
M)|^2 = -2 sum_k cos(k M w) / k stands at lag M with -1, which no smooth spectrum has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig_identification.check.readings.channel_model import Array, Indices

#: Order of the differences that take a signal's slow part away before its spectrum is taken.
_ORDER = 3
#: Fewer samples average nothing that matters: the delay is below an interval and a half.
LEAST = 4
#: A recording holds at least this many windows.
_WINDOWS = 6
#: A logarithm of a periodogram has this variance, and a Hann window makes 1.94 neighbours one.
_VARIANCE = np.pi**2 / 6.0 * 1.94
#: Cosines of the logarithm of a smooth spectrum, with and without the comb: four poles of a filter.
_COSINES = 9
#: Differences beyond this many medians, six std of noise, are no noise.
_BLOW = 4.0
#: Candidates of the window that are looked at closely.
_CANDIDATES = 3
#: White rounding beside the averaged noise, relative to the noise before the average.
_FLOORS = 10.0 ** np.arange(-8.0, -0.9, 0.5)
#: Of the nulls this share must lie below the middle between them.
_NULLS = 0.9


@dataclass(frozen=True)
class Comb:
    """An average that a spectrum shows."""

    samples: int
    floor: float  # white noise beside it, relative to the noise before the average
    gain: float  # nats against a smooth spectrum


def log_spectrum(column: Array) -> Array:
    """(k,) logarithm of the noise's spectrum at f = (1 ... k) / (2 k + 2) cycles a sample."""
    bends = np.diff(column, _ORDER)
    # A single blow or spike would have a spectrum of its own
    reach = _BLOW * float(np.median(np.abs(bends)))
    bends = np.clip(bends, -reach, reach)
    spectrum = np.abs(np.fft.rfft(bends * np.hanning(len(bends)))) ** 2
    frequency = np.arange(len(spectrum)) / len(bends)
    inside = (frequency > 0.0) & (frequency < 0.5)
    gain = (2.0 * np.sin(np.pi * frequency[inside])) ** (2 * _ORDER)
    return np.asarray(np.log(np.maximum(spectrum[inside] / gain, 1e-300)))


def candidates(logs: list[Array]) -> Indices:
    """The windows, in samples, at which the mean cepstrum of several columns is deepest."""
    cepstrum = np.mean([_cepstrum(one) for one in logs], axis=0)
    longest = len(cepstrum) // _WINDOWS
    lags = np.arange(LEAST, longest)
    if not len(lags):
        return np.zeros(0, np.int64)
    deep = lags[np.argsort(cepstrum[lags], kind="stable")[:_CANDIDATES]]
    # Of -1 rounding leaves a part; 0.1 is several std of a piece's
    return np.asarray(deep[cepstrum[deep] < -0.1])


def _cepstrum(log: Array) -> Array:
    whole = np.concatenate(([log[0]], log, [log[-1]]))
    return np.asarray(np.fft.irfft(whole - np.mean(whole)))


def comb(log: Array, samples: int) -> Comb:
    """How much better an average over ``samples`` explains a spectrum than a smooth one does."""
    frequency = np.arange(1, len(log) + 1) / (2.0 * (len(log) + 1))
    response = squared_response(frequency, samples)
    cosines = np.cos(2.0 * np.pi * frequency[:, None] * np.arange(_COSINES))
    basis = np.linalg.qr(cosines)[0]
    without = _left(log, basis)
    left = [_left(log - np.log(response + floor), basis) for floor in _FLOORS]
    best = int(np.argmin(left))
    gain = (without - left[best]) / (2.0 * _VARIANCE)
    return Comb(
        int(samples), float(_FLOORS[best]), gain if _nulls(log, frequency, samples) >= _NULLS else 0.0
    )


def squared_response(frequency: Array, samples: int) -> Array:
    """(k,) D^2 at frequencies in cycles a sample."""
    return np.asarray((np.sin(np.pi * frequency * samples) / (samples * np.sin(np.pi * frequency))) ** 2)


def _left(log: Array, orthogonal: Array) -> float:
    """Squares of what the columns of ``orthogonal`` leave of a spectrum's logarithm."""
    return float(np.sum((log - orthogonal @ (orthogonal.T @ log)) ** 2))


def _nulls(log: Array, frequency: Array, samples: int) -> float:
    """Share of the nulls around which the spectrum is lower than midway to the next ones."""
    phase = frequency * samples
    number = np.round(2.0 * phase).astype(np.int64)  # even: a null; odd: midway
    near = np.abs(2.0 * phase - number) < 0.25
    count = np.bincount(number[near], minlength=samples + 1)
    level = np.bincount(number[near], log[near], minlength=samples + 1) / np.maximum(count, 1)
    even = np.arange(2, samples + 1, 2)
    upper = np.where(even + 1 < len(level), even + 1, even - 1)
    upper = np.where((upper < len(count)) & (count[np.minimum(upper, len(count) - 1)] > 0), upper, even - 1)
    known = (count[even] > 0) & (count[even - 1] > 0)
    deeper = level[even] < 0.5 * (level[even - 1] + level[upper])
    return float(np.mean(deeper[known])) if known.any() else 0.0
