"""Where the exciter's force was not sampled: bridged where that is short, a break in the run where it is not.

The force drives the model, so what it did in a gap is not left out like a missing reading: the motion
after the gap remembers it. A short gap is bridged by a straight line, and the force's error about it is noise
of the size that such bridges have over the rest of the recording, of the same integral as an error that
keeps its sign all through the gap. Behind a long gap the body is somewhere else: the run begins anew there,
with a start state of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from rig_identification.estimate.sampling import Grid

Array = NDArray[np.float64]

#: An interval this much longer than the median one, and than a node's, is a gap.
GAP = 2.5
#: Samples whose mean is the force at the edge of a gap.
EDGE = 3
#: Samples further apart than this part of a node's step are too few for the nodes: what lies between them is
#: interpolated first.
SPARSE = 0.6
#: A bridge may be off by so many times the impulse that the force's noise adds up to in a second: the model
#: is linear over what that moves.
OWN = 30.0


@dataclass(frozen=True)
class Bridged:
    """Samples of a force whose short gaps are filled."""

    time: Array  # (n,) s
    values: Array  # (n, w)
    variance: Array  # (nodes,) N^2, of each component held over a node interval: what the filling may be off
    unknown: tuple[tuple[float, float], ...]  # stretches (s) too long to be filled


def bridged(grid: Grid, time: Array, values: Array, noise: float) -> Bridged:
    """Samples (n, w) with straight lines across gaps; noise: standard deviation of one sample."""
    median = float(np.median(np.diff(time)))
    shortest = GAP * max(median, grid.step)
    spectrum = _spectrum(time, values, noise)
    # What the noise alone adds to the body's momentum in a second
    most = OWN * noise * np.sqrt(median)
    variance = np.zeros(grid.nodes)
    filled_time, filled_values = [time], [values]
    unknown = []
    edges = np.concatenate([[0.0], time, [grid.duration]])
    for i in np.flatnonzero(np.diff(edges) > shortest):
        start, end = float(edges[i]), float(edges[i + 1])
        inside = 0 < i < time.size
        square = spectrum.chord(end - start) if inside else spectrum.change(end - start)
        before, after = values[max(0, i - EDGE) : i], values[i : i + EDGE]
        first = np.mean(before if before.size else after, axis=0)
        last = np.mean(after if after.size else before, axis=0)
        at = np.arange(start + 0.5 * median, end, median)
        share = ((at - start) / (end - start))[:, None]
        filled_time.append(at)
        filled_values.append((1.0 - share) * first + share * last)
        if np.sqrt(square) * (end - start) > most:
            unknown.append((start, end))
        else:
            _doubt(variance, grid, start, end, square)
    all_time, all_values = np.concatenate(filled_time), np.concatenate(filled_values)
    order = np.argsort(all_time, kind="stable")
    all_time, all_values = all_time[order], all_values[order]
    if median > SPARSE * grid.step and all_time.size > 4:
        all_time, all_values = _between(grid, all_time, all_values)
    return Bridged(all_time, all_values, variance, tuple(unknown))


def _between(grid: Grid, time: Array, values: Array) -> tuple[Array, Array]:
    """Two samples a node by local cubics (Akima, Journal of the ACM 17, 1970), which no jump makes ring.

    A line between samples 20 ms apart is off by half a percent of a force that turns at 2 Hz, between each
    two samples anew.
    """
    fine = np.arange(time[0], time[-1], 0.5 * grid.step)
    return fine, np.asarray(Akima1DInterpolator(time, values)(fine), dtype=np.float64)


def _doubt(variance: Array, grid: Grid, start: float, end: float, square: float) -> None:
    """Add an error of mean ``square`` that lasts from ``start`` to ``end`` s, as white noise."""
    first = max(0, int(np.floor(start / grid.step)))
    last = min(grid.nodes, int(np.ceil(end / grid.step)))
    variance[first:last] += square * max(1.0, (end - start) / grid.step)


class _Spectrum:
    """Power of a force by frequency, mean of its components, and what it does over a time."""

    def __init__(self, power: Array, omega: Array) -> None:
        self._power, self._omega = power, omega

    def chord(self, gap: float) -> float:
        """Mean square error of a straight line over ``gap`` s: at most the wave itself and the line."""
        return float(np.sum(self._power * np.minimum(2.0, ((self._omega * gap) ** 2 / 8.0) ** 2)))

    def change(self, gap: float) -> float:
        """Mean square change over ``gap`` s."""
        return float(np.sum(self._power * np.minimum(2.0, (self._omega * gap) ** 2)))


def _spectrum(time: Array, values: Array, noise: float) -> _Spectrum:
    """Of the samples as if they were equidistant; the noise's share is taken off. The mean counts at 0 Hz."""
    count = time.size
    lines = np.abs(np.fft.rfft(values, axis=0)) ** 2 / count**2
    lines[1 : (count + 1) // 2] *= 2.0
    power = np.maximum(np.mean(lines, axis=1) - 2.0 * noise**2 / count, 0.0)
    frequency = np.asarray(np.fft.rfftfreq(count, float(np.median(np.diff(time)))), dtype=np.float64)
    return _Spectrum(power, 2.0 * np.pi * frequency)
