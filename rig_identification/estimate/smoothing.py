"""An input without its noise: what a clock's offset moves, and what is differentiated.

A clock's offset moves the force's smoothed values, not its samples: noise that is resampled at each value of
the clock moves the cost in a way that no derivative describes. What the smoothing takes off stays where it
was stamped. A wide Gaussian leaves little noise in the rate, and takes off what a hammer's blow of 40 ms has
above 12 Hz: of an offset of 1 ms load cells then show 0.4 N beyond the model, which is no physics. So the
width is the largest that takes off noise alone, as a spline's frequency is chosen (smooth_force.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.signal.windows import hann

Array = NDArray[np.float64]

#: s, widths of the Gaussian, the widest first; and the narrowest in nodes, below which it smooths nothing.
WIDTHS = 0.015 * 0.5 ** np.arange(4)
NARROWEST = 0.5
#: What white noise does in one of some thousand: in nats beyond the logarithm of their number the loudest
#: line of its spectrum and half the square of the largest mean; and a second's mean square, in its own stds.
LOUD, WORST = 7.0, 5.0
#: Samples of a window that counts as a second, at least.
SHORT = 16


@dataclass(frozen=True)
class SmoothInput:
    """An input without its noise, at any time about the nodes: what a clock's offset moves along."""

    spline: CubicSpline  # of s after the first node of the whole recording, (w,)
    step: float  # s between nodes
    first: float  # node of the recording that the input's own first node is; between two of wide nodes
    nodes: int

    def at(self, late: float, order: int = 0, between: float = 0.0) -> Array:
        """(nodes, w) derivative of that order, ``late`` seconds after each node.

        between: how far after the node itself, in steps. Beyond the recording the input goes on along a line.
        """
        edges = self.spline.x[[0, -1]]
        time = self.step * (self.first + np.arange(self.nodes) + between) + late
        inside = np.clip(time, *edges)
        out = self.spline(inside, order)
        if order == 0:
            out = out + (time - inside)[:, None] * self.spline(inside, 1)
        elif order > 1:
            out[time != inside] = 0.0
        return np.asarray(out)

    def midway(self, late: float) -> Array:
        """(nodes, w) midway to the next node, beyond the mean of both, ``late`` seconds after."""
        ends = self.at(late) + self.at(late, between=1.0)
        return np.asarray(self.at(late, between=0.5) - 0.5 * ends)


def smoothed(
    step: float, nodes: Array, time: Array, values: Array, noise: float
) -> tuple[SmoothInput, float]:
    """An input (nodes, w) at nodes ``step`` s apart without its noise, and the Gaussian's width, s.

    time (n,), values (n, w): the samples that it is of; noise: standard deviation of one. The widest Gaussian
    that takes off noise alone; the narrowest where none does, as of jumps and of samples without noise; the
    widest where too few samples tell, or nodes lie too far apart for a narrower one.
    """
    inside = (time >= 0.0) & (time <= step * (len(nodes) - 1))
    time, values = time[inside], values[inside]
    narrow = np.count_nonzero(NARROWEST * step <= WIDTHS) if time.size >= SHORT else 0
    widths = WIDTHS[: max(1, narrow)]
    for width in widths[:-1]:
        smooth = smoothed_input(step, nodes, width)
        if noise > 0.0 and noise_alone(
            time, (values - smooth.spline(time)) / noise, 1.0 / (2.0 * np.pi * width)
        ):
            return smooth, float(width)
    return smoothed_input(step, nodes, widths[-1]), float(widths[-1])


def smoothed_input(step: float, nodes: Array, width: float) -> SmoothInput:
    """A noisy input (nodes, w) at nodes ``step`` s apart, smoothed by a Gaussian of ``width`` s.

    What the Gaussian takes off is put back once (Tukey's twicing): of 1.8 % at 2 Hz and 15 ms, which a
    clock's offset would be wrong by, 0.03 % stays. It goes on beyond its ends turned about them, so that its
    slope there is its own.
    """
    wide = width / step
    count = len(nodes)
    ahead = min(count - 1, int(np.ceil(8.0 * wide)))
    padded = np.pad(nodes, ((ahead, ahead), (0, 0)), mode="reflect", reflect_type="odd")
    once = gaussian_filter1d(padded, wide, axis=0)
    twice = (2.0 * once - gaussian_filter1d(once, wide, axis=0))[ahead : ahead + count]
    return SmoothInput(CubicSpline(step * np.arange(count), twice), step, 0, count)


def rate_noise(step: float, width: float) -> float:
    """Variance (1/s2) of the smoothed input's rate, in that of the white noise of its nodes ``step`` apart.

    Twicing a Gaussian of width s leaves H = 2 g - g^2 of a frequency w, g = exp(-(w s)^2 / 2), and the
    integral of (w H)^2 over all of them is sqrt(pi)/4 (4 - 4 / 1.5^1.5 + 1 / 2^1.5) / s^3.
    """
    integral = np.sqrt(np.pi) / 4.0 * (4.0 - 4.0 / 1.5**1.5 + 1.0 / 2.0**1.5)
    return float(integral / width**3 / (np.pi / step))


def noise_alone(time: Array, left: Array, cutoff: float) -> bool:
    """Whether residuals (n, w), in units of their noise, are no louder anywhere than white noise.

    Over a second, along the whole recording as a line of the spectrum, and about an instant, such as a
    kink's, as a mean over half a cycle of ``cutoff`` Hz or less.
    """
    count = time.size
    rate = count / max(float(time[-1] - time[0]), 1.0)
    second = max(SHORT, round(rate))
    square = uniform_filter1d(left**2, second, axis=0)[second // 2 : count - second // 2]
    if np.max(square, initial=0.0) > 1.0 + WORST * np.sqrt(2.0 / second):
        return False
    window = hann(count)[:, None]
    lines = np.abs(np.fft.rfft(window * left, axis=0)) ** 2 / np.sum(window**2)
    if np.max(lines) > np.log(lines.size) + LOUD:
        return False
    widths = 2 ** np.arange(1 + int(np.log2(max(1.0, rate / (2.0 * cutoff)))))
    loudest = max(width * float(np.max(uniform_filter1d(left, width, axis=0) ** 2)) for width in widths)
    return bool(loudest < 2.0 * (np.log(left.size) + LOUD))
