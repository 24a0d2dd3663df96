"""Period, amplitude and decay of one free swing, as a person with a stop watch would read them.

A signal is cut into windows of two periods. Each window gives an amplitude and a phase by least squares. The
phases run on with the frequency at small amplitudes, ω0, times the time that the amplitude's correction
leaves: ω(A) = ω0 (1 - κ A²). A line through the phases is ω0; the logarithm of the amplitudes is the decay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Periods of a window: its own line is apart from a slow drift, and the amplitude hardly falls within it.
WINDOW = 2.0
#: Windows below which a line through their phases says nothing of its own scatter.
FEWEST = 4
#: Share of the largest amplitude below which a window is left out: what it holds is no longer the swing.
DIED = 0.1
#: Samples of a window of which its five numbers are told.
SAMPLES = 10


@dataclass(frozen=True)
class FreeSwing:
    """One line of one signal."""

    frequency: float  # rad/s, at small amplitudes and without damping
    frequency_std: float  # rad/s, of the scatter of the phases
    amplitude: float  # of the first window, in the unit of the angle
    decay: float  # 1/s, of the amplitude
    windows: int


def free_swing(time: Array, values: Array, kappa: float, *, rate: bool) -> FreeSwing | None:
    """The strongest line of ``values`` (n,) at ``time`` (n,) s; None where too little tells.

    kappa: κ of ω(A) = ω0 (1 - κ A²), 1/rad². rate: ``values`` are the angle's rate.
    """
    if time.size < FEWEST * SAMPLES:
        return None
    rough = _strongest(time, values)
    length = WINDOW * 2.0 * np.pi / rough
    found = _windows(time, values, rough, length)
    if len(found) < FEWEST:
        return None
    middle, lines = np.array([f[0] for f in found]), np.array([f[1] for f in found])
    amplitude = np.abs(lines) / (rough if rate else 1.0)
    kept = amplitude > DIED * np.max(amplitude)
    if np.count_nonzero(kept) < FEWEST:
        return None
    middle, amplitude, phase = middle[kept], amplitude[kept], np.unwrap(np.angle(lines[kept]))
    weight = amplitude
    decay, offset = np.polyfit(middle, np.log(amplitude), 1, w=weight)
    # Phases beside exp(i rough t): what is left of ω0 (time less its correction)
    passed = middle - kappa * _integral(middle, amplitude**2)
    total = phase + rough * middle
    line, scatter = _line(passed, total, weight)
    return FreeSwing(
        float(np.hypot(line, decay)),
        scatter,
        float(np.exp(offset + decay * middle[0])),
        float(-decay),
        int(middle.size),
    )


def _strongest(time: Array, values: Array) -> float:
    """rad/s of the strongest line, to a part of the spectrum's own resolution."""
    even = np.linspace(time[0], time[-1], time.size)
    signal = np.interp(even, time, values)
    window = np.hanning(time.size)
    count = 8 * time.size
    power = np.abs(np.fft.rfft((signal - np.mean(signal)) * window, count))
    top = int(np.argmax(power[8:])) + 8
    step = (time[-1] - time[0]) / (time.size - 1)
    return float(2.0 * np.pi * top / (count * step))


def _windows(time: Array, values: Array, rough: float, length: float) -> list[tuple[float, complex]]:
    """Middle (s) of each window, and its line about exp(i rough t)."""
    number = np.floor((time - time[0]) / length).astype(np.int64)
    out = []
    for k in range(int((time[-1] - time[0]) / length + 1e-9)):
        mine = number == k
        t = time[mine]
        if t.size < SAMPLES or t[-1] - t[0] < 0.8 * length:
            continue
        middle = time[0] + (k + 0.5) * length
        beside = (t - middle) / length
        angle = rough * t
        basis = np.stack([np.cos(angle), -np.sin(angle), np.ones_like(t), beside], axis=1)
        share = np.linalg.lstsq(basis, values[mine], rcond=None)[0]
        out.append((middle, complex(share[0], share[1])))
    return out


def _integral(time: Array, values: Array) -> Array:
    """(n,) integral of ``values`` over ``time`` from the first on, by the trapezium rule."""
    steps = 0.5 * np.diff(time) * (values[1:] + values[:-1])
    return np.concatenate([[0.0], np.cumsum(steps)])


def _line(x: Array, y: Array, weight: Array) -> tuple[float, float]:
    """Slope of the weighted line through points, and its std from their scatter."""
    basis = np.stack([np.ones_like(x), x - np.average(x, weights=weight**2)], axis=1) * weight[:, None]
    found = np.linalg.lstsq(basis, weight * y, rcond=None)[0]
    left = weight * y - basis @ found
    variance = float(left @ left) / (x.size - 2)
    return float(found[1]), float(np.sqrt(variance / float(np.sum(basis[:, 1] ** 2))))
