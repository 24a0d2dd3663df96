"""How long a swing takes, how long a piece of a run has to be to tell of it, and what lies beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.sampling import LOCAL

Array = NDArray[np.float64]

#: Swings over which one is followed by its own line, its size and its middle changing steadily: six numbers.
FOLLOWED = 2.0
#: Shares by which a swing's period may differ from the strongest line of a few swings.
ABOUT = np.linspace(-0.03, 0.03, 25)
#: Swings that a piece holds at least where nothing but the motion is measured: inertia then shows in the
#: period alone, and a period in no less than a turn and its half.
SWINGS = 1.5
#: Quantities that tell of inertia within a moment: force, and acceleration.
FORCES = frozenset({"tension", "specific_force"})


def swing_period(run: Run) -> float:
    """Period (s) of the strongest line, each axis in units of its noise.

    Between the lines of the spectrum it is found by a parabola through the logarithms of three.
    """
    best, period = 0.0, LOCAL
    for c in run.channels:
        step = (c.time[-1] - c.time[0]) / max(c.time.size - 1, 1)
        centred = (c.values - np.mean(c.values, axis=0)) / c.noise
        power = np.abs(np.fft.rfft(centred * np.hanning(c.time.size)[:, None], axis=0))
        line = int(np.argmax(np.max(power[1:], axis=1))) + 1
        loudest = int(np.argmax(power[line]))
        if power[line, loudest] > best:
            at = line + _between(power[:, loudest], line)
            best, period = float(power[line, loudest]), step * c.time.size / at
    return max(period, LOCAL)


def _between(power: Array, line: int) -> float:
    """How far, in lines, the peak lies from the highest ``line`` of a spectrum's magnitudes."""
    if not 1 < line < power.size - 1:
        return 0.0
    below, top, above = np.log(np.maximum(power[line - 1 : line + 2], 1e-300))
    bend = below - 2.0 * top + above
    return float(np.clip(0.5 * (below - above) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0


def long_enough(run: Run, seconds: float, swings: float = SWINGS) -> float:
    """``seconds``, or what so many swings take where a run measures neither force nor acceleration."""
    if any(c.quantity in FORCES for c in run.channels):
        return seconds
    return max(seconds, min(swings * swing_period(run), run.grid.duration))


def beside_a_swing(time: Array, values: Array, period: float, beside: Array | None = None) -> Array:
    """(w,) std of what no swing follows in samples (n, w); 0: too few tell.

    period: s, about which the swing's own is looked for: a spectrum of a few swings is off by per cents, and
    what a wrong period leaves is no noise. beside (n, k): what a device may read beside the swing, each
    column in one amount over all samples, and is no noise either.
    """
    shapes = np.zeros((time.size, 0)) if beside is None else beside
    tried = [_left_beside(time, values, period * (1.0 + off), shapes) for off in ABOUT]
    return np.asarray(np.min(tried, axis=0))


def _left_beside(time: Array, values: Array, period: float, beside: Array) -> Array:
    """(w,) std of what a swing of exactly this period, its size and middle changing steadily, leaves."""
    block = np.floor((time - time[0]) / (FOLLOWED * period)).astype(np.int64)
    width, left, freedom = values.shape[1], [], 0
    columns = np.concatenate([values, beside], axis=1)
    for number in np.unique(block):
        here = block == number
        t = time[here] / period
        if t.size < 12:
            continue
        t = t - np.mean(t)
        angle = 2.0 * np.pi * t
        line = np.stack([np.ones_like(t), np.cos(angle), np.sin(angle)], axis=1)
        basis = np.linalg.qr(np.concatenate([line, t[:, None] * line], axis=1))[0]
        left.append(columns[here] - basis @ (basis.T @ columns[here]))
        freedom += t.size - basis.shape[1]
    if not left:
        return np.zeros(width)
    rest, read = np.split(np.concatenate(left), [width], axis=1)
    rest = rest - read @ np.linalg.lstsq(read, rest, rcond=None)[0]
    return np.asarray(np.sqrt(np.sum(rest**2, axis=0) / max(freedom - beside.shape[1], 1)))
