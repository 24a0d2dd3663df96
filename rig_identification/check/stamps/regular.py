"""Regular sampling: how a stamp comes about, and how far the stamps of a stream are from it.

Sample ``k`` of a device is measured at ``start + interval * index[k]``; the index skips what was lost. A
stamp is that time on the device's clock with ordinary jitter, which falls on either side alike. Stamps taken
on arrival are late by a latency that is never negative, so that the times of measurement lie along their
lower envelope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.stamps.streams import SECOND
from rig_identification.raw import Stamps

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Handovers over which an envelope is taken: of 20 one lies within a twentieth of an interval of the envelope
#: with probability 1 - 0.95**20 = 2/3, and within a tenth of one with 0.9. Samples at least: 20 times 3.
_HANDOVERS, _BLOCK = 20, 64
#: Loss is counted where the envelope rises by more than this part of an interval: it lies at most a tenth
#: of an interval high (see _BLOCK), and the slope adds less than that over a block.
_RISE = 0.75
#: Handovers at the end of a stream, and samples at least, among which no loss is sought: an envelope needs
#: several.
_LAST, _TAIL = 8, 24
#: First stretch over which an interval is sought, and how many of its best candidates are followed further.
_STRETCH, _FOLLOWED = 512, 6
#: Part of the samples that may be lost; a device that loses more has no rate to speak of.
_LOST = 0.15
#: Samples closer than this part of an interval were stamped at one instant: no sampling is so uneven.
TOGETHER = 0.1


@dataclass(frozen=True)
class Grid:
    """Times of measurement of a stream, with the stamps' lateness against them."""

    start: float  # s after the first stamp
    interval: float  # s
    index: Indices  # (n,) intervals from the first sample to each, not falling
    late: Array  # (n,) s, stamp less time of measurement

    @property
    def times(self) -> Array:
        """(n,) s after the first stamp."""
        since: Array = self.index.astype(np.float64)
        return self.start + self.interval * since


def seconds(stamps: Stamps) -> Array:
    """(n,) s after the first stamp."""
    since: Array = (stamps - stamps[0]).astype(np.float64)
    return since / SECOND


def mean_interval(times: Array) -> float:
    """Interval over many samples: jumps, stalls and bursts shorter than 64 samples do not move it."""
    lag = int(np.clip(len(times) // 8, 1, _BLOCK))
    return float(np.median(times[lag:] - times[:-lag])) / lag


def usual_interval(times: Array) -> float:
    """Median interval where that is an interval of sampling, else the mean one of a stream in bursts."""
    steps = np.diff(times)
    steps = steps[steps > 0.0]
    mean = mean_interval(times)
    median = float(np.median(steps)) if len(steps) else mean
    return median if median > 0.5 * mean or mean <= 0.0 else mean


def envelope_grid(times: Array, interval: float | None = None) -> Grid:
    """The regular grid under stamps that are late by a latency of any law.

    times (n,): s, in the order of measurement. Lost samples show as a lasting rise of the envelope by whole
    intervals: what is below the envelope later on was not late before. interval: s, where it is known.
    """
    if interval is None:
        interval = lossless_interval(times)
        interval = _sought_interval(times) if interval is None else interval
    index, start = np.zeros(len(times), np.int64), 0.0
    for _ in range(2):
        index = _index(times, interval)
        interval, start = _line(times, index)
    return Grid(start, interval, index, times - start - interval * index)


def lossless_interval(times: Array) -> float | None:
    """Interval (s) of a stream that lost nothing, as its envelope shows; None where it is not straight."""
    count = np.arange(len(times))
    interval, start = _line(times, count)
    lowest = _lowest(times - start - interval * count, _block(times))
    # The lowest of 64 latencies lie within a tenth of an interval; a loss moves the line by half of one.
    return interval if float(np.ptp(lowest)) < 0.4 * interval else None


def _block(times: Array) -> int:
    """Samples over which an envelope is taken."""
    return max(_BLOCK, math.ceil(_HANDOVERS * _together(times)))


def _together(times: Array) -> float:
    """Samples of a handover, in the mean."""
    return len(times) / (1 + float(np.count_nonzero(np.diff(times) > TOGETHER * mean_interval(times))))


def _lowest(rest: Array, block: int) -> Array:
    """Lowest of each block of samples."""
    edges = np.linspace(0, len(rest), max(len(rest) // block, 1) + 1).astype(int)
    return np.minimum.reduceat(rest, edges[:-1])


def _sought_interval(times: Array) -> float:
    """Likeliest interval (s), sought over growing stretches.

    Each stretch resolves it to a quarter of an interval over its length.
    """
    count = len(times)
    mean = float((times[-1] - times[0]) / (count - 1))
    length = min(count, _STRETCH)
    step = mean / (4.0 * length)
    trial = np.arange((1.0 - _LOST) * mean, 1.005 * mean, step)
    while True:
        costs = np.array([_cost(times[:length], interval) for interval in trial])
        if length == count:
            return float(trial[int(np.argmin(costs))])
        best = trial[np.argsort(costs, kind="stable")[:_FOLLOWED]]
        length = min(4 * length, count)
        step /= 4.0
        trial = np.unique((best[:, None] + step * np.arange(-4, 5)).ravel())


def _index(times: Array, interval: float) -> Indices:
    count = np.arange(len(times))
    rest = times - interval * count
    tail = max(len(times) - max(_TAIL, math.ceil(_LAST * _together(times))), 0)
    lowest = np.minimum.accumulate(rest[::-1])[::-1]
    lowest[tail:] = lowest[tail]  # too few samples follow to tell a rise from lateness
    lost = np.floor((lowest - lowest[0]) / interval + 1.0 - _RISE)
    return np.asarray(count + np.maximum(lost, 0.0), np.int64)


def _cost(times: Array, interval: float) -> float:
    """Negative log likelihood (nats) of latencies of exponential law, each lost stretch priced by its place.

    Samples handed over together share one latency.
    """
    index = _index(times, interval)
    late = times - interval * index
    mean = float(np.mean(late - np.min(late))) + 1e-3 * interval
    handovers = 1 + np.count_nonzero(np.diff(times) > TOGETHER * interval)
    losses = np.count_nonzero(np.diff(index) > 1)
    return float(handovers * math.log(mean) + losses * math.log(len(times)))


def _line(times: Array, index: Indices) -> tuple[float, float]:
    """Interval and start of the line along the blocks' lowest samples."""
    blocks = max(len(times) // _block(times), 1)
    edges = np.linspace(0, len(times), blocks + 1).astype(int)
    rough = (times[-1] - times[0]) / max(int(index[-1] - index[0]), 1)
    rest = times - rough * index
    lowest = np.array([a + int(np.argmin(rest[a:b])) for a, b in pairwise(edges)])
    slope = 0.0
    if blocks >= 4:
        for _ in range(2):
            slope = _slope(index[lowest].astype(float), rest[lowest])
            leaning = rest - slope * index
            lowest = np.array([a + int(np.argmin(leaning[a:b])) for a, b in pairwise(edges)])
    return rough + slope, float(np.median(rest[lowest] - slope * index[lowest]))


def _slope(x: Array, y: Array) -> float:
    """Median of the slopes between points half the range apart (Theil and Sen)."""
    half = len(x) // 2
    return float(np.median((y[half:] - y[: len(y) - half]) / (x[half:] - x[: len(x) - half])))


def rate_line(times: Array, usual: float | None = None) -> tuple[float, float]:
    """Interval (s) at which the stamps' phases agree best, and how well: 1 perfectly, 0 not at all.

    The largest line of the stamps' spectrum within 6 % of one over the usual interval: losses of a tenth of
    the samples move the median of jittering intervals by less. usual: s, where that is known better.
    """
    usual = usual_interval(times) if usual is None else usual
    span = float(times[-1] - times[0])
    width = usual / 8.0
    bins = int(span / width) + 1
    if usual <= 0.0 or bins > 2**24:
        return usual, 0.0
    size = 2 ** math.ceil(math.log2(2 * bins))
    counts = np.bincount(np.clip((times - times[0]) / width, 0, bins - 1).astype(np.int64), minlength=bins)
    spectrum = np.abs(np.fft.rfft(counts, size))
    resolution = 1.0 / (size * width)
    low, high = int(0.94 / usual / resolution), int(1.06 / usual / resolution) + 2
    middle = (low + int(np.argmax(spectrum[low:high]))) * resolution
    for _ in range(3):
        trial = middle + resolution * np.linspace(-1.0, 1.0, 9)
        line = [abs(np.mean(np.exp(2j * np.pi * f * times))) for f in trial]
        middle, resolution = float(trial[int(np.argmax(line))]), resolution / 4.0
    return 1.0 / middle, float(max(line))


def evenly_spaced(times: Array) -> Grid | None:
    """The regular grid amid stamps that are early as often as late; None where samples cannot be counted.

    times (n,): s, in the order of measurement. A sample keeps its number while its stamp is off by less than
    half an interval; what is lost shows as a number left out.
    """
    interval, agreement = rate_line(times)
    if agreement == 0.0:
        return None
    phase = np.angle(np.mean(np.exp(2j * np.pi * times / interval))) / (2.0 * np.pi)
    index = np.round(times / interval - phase).astype(np.int64)
    if np.any(np.diff(index) < 1):
        return None
    slope, start = np.polynomial.Polynomial.fit(index, times, 1).convert().coef[::-1]
    return Grid(float(start), float(slope), index, times - start - slope * index)
