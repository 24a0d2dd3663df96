"""From node values to sample times: interpolation, grouping and input reconstruction as linear maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.ndimage import maximum_filter1d, median_filter, uniform_filter1d
from scipy.signal import savgol_coeffs, savgol_filter
from scipy.sparse import csr_matrix

from rig_identification.estimate.smoothing import SmoothInput, rate_noise, smoothed

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Grid:
    """Equidistant nodes of one run, from time 0 of the recording on."""

    step: float  # s
    nodes: int

    @property
    def duration(self) -> float:
        """Time of the last node, s."""
        return self.step * (self.nodes - 1)


#: Cubic Lagrange polynomials through nodes 0 to 3: coefficients (node, power).
_CUBIC = np.array(
    [[6.0, -11.0, 6.0, -1.0], [0.0, 18.0, -15.0, 3.0], [0.0, -9.0, 12.0, -3.0], [0.0, 2.0, -3.0, 1.0]]
)
_CUBIC /= 6.0


class Sampler:
    """Cubic interpolation from the nodes to one channel's grouped samples, whatever its clock is late by.

    A weight is a cubic in the lateness: which nodes it is of is found once, and a new
    lateness costs four numbers a weight.
    """

    def __init__(self, grid: Grid, time: Array, group: Index, groups: int) -> None:
        """grid: the nodes. time (n,), group (n,): of each sample; groups: number of groups."""
        self._grid, self._time, self._group, self._groups = grid, time, group, groups
        self._found = self._weights(0)
        self._last: tuple[float, csr_matrix, csr_matrix] | None = None

    def _weights(self, shift: int) -> tuple[int, Array, Any, Any]:
        """For a lateness of ``shift`` nodes: Taylor coefficients (4, w) of the weights, their nodes, rows."""
        grid = self._grid
        position = self._time / grid.step - shift
        first = np.clip(np.floor(position).astype(np.int64) - 1, 0, grid.nodes - 4)
        s = position - first
        share = 1.0 / np.bincount(self._group, minlength=self._groups)[self._group]
        key = (self._group * grid.nodes + first)[:, None] + np.arange(4)
        cells, place = np.unique(key, return_inverse=True)
        place = place.ravel()
        c = _CUBIC
        s = s[:, None]
        taylor = (
            c[:, 0] + s * (c[:, 1] + s * (c[:, 2] + s * c[:, 3])),
            c[:, 1] + s * (2.0 * c[:, 2] + s * 3.0 * c[:, 3]),
            c[:, 2] + s * 3.0 * c[:, 3],
            np.broadcast_to(c[:, 3], key.shape),
        )
        weights = [np.bincount(place, (t * share[:, None]).ravel(), cells.size) for t in taylor]
        powers = np.array(weights, dtype=np.float64)
        rows = np.searchsorted(cells // grid.nodes, np.arange(self._groups + 1))
        return shift, powers, cells % grid.nodes, rows

    def at(self, late: float = 0.0) -> tuple[csr_matrix, csr_matrix]:
        """Matrices (groups, nodes): mean over each group of the interpolated value, and of its rate.

        late: s by which the samples' stamps are late.
        """
        last = self._last
        if last is not None and last[0] == late:
            return last[1], last[2]
        shift = round(late / self._grid.step)
        found = self._found
        if shift != found[0]:
            # In one piece: another thread may read it
            found = self._found = self._weights(shift)
        _, powers, nodes, rows = found
        d = shift - late / self._grid.step
        value = powers[0] + d * (powers[1] + d * (powers[2] + d * powers[3]))
        slope = (powers[1] + d * (2.0 * powers[2] + d * 3.0 * powers[3])) / self._grid.step
        shape = (self._groups, self._grid.nodes)
        at, rate = (csr_matrix((w, nodes, rows), shape=shape) for w in (value, slope))
        self._last = late, at, rate
        return at, rate


def interpolation(grid: Grid, time: Array, group: Index, groups: int) -> tuple[csr_matrix, csr_matrix]:
    """:class:`Sampler` for stamps that are right, used once."""
    return Sampler(grid, time, group, groups).at()


def group_by_node(grid: Grid, time: Array) -> tuple[Index, Index]:
    """(group of each sample, node of each group): samples nearest the same node are averaged together.

    A sensor faster than the nodes loses nothing that the motion could show, and the rows
    of a fit stay bounded.
    """
    nearest = np.clip(np.rint(time / grid.step).astype(np.int64), 0, grid.nodes - 1)
    node, group = np.unique(nearest, return_inverse=True)
    return group.astype(np.int64), node


def node_values(grid: Grid, time: Array, values: Array) -> Array:
    """(nodes, w) piecewise linear input that fits samples (n, w) in least squares.

    The least-squares spline keeps the low frequencies (error of order (w h)^4) and averages
    the noise; a trace of second-difference penalty carries it across gaps.
    """
    position = np.clip(time / grid.step, 0.0, grid.nodes - 1.0)
    left = np.minimum(position.astype(np.int64), grid.nodes - 2)
    right_weight = position - left
    left_weight = 1.0 - right_weight
    n = grid.nodes
    diagonal = np.bincount(left, left_weight**2, n) + np.bincount(left + 1, right_weight**2, n)
    beside = np.bincount(left, left_weight * right_weight, n)
    bands = np.zeros((3, n))
    bands[0], bands[1, :-1] = diagonal, beside[:-1]
    penalty = 1e-3 * max(time.size / n, 1e-3)
    second = np.array([1.0, -2.0, 1.0])
    for a in range(3):
        for b in range(a, 3):
            bands[b - a, a : n - 2 + a] += penalty * second[a] * second[b]
    right = np.stack(
        [
            np.bincount(left, left_weight * v, n) + np.bincount(left + 1, right_weight * v, n)
            for v in values.T
        ],
        axis=1,
    )
    return np.asarray(solveh_banded(bands, right, lower=True))


#: A change between two nodes is a jump where it differs from its neighbours' by so many standard
#: deviations of noise, and by so many times their size.
JUMP_IN_NOISE, JUMP_IN_CHANGE = 8.0, 3.0


def jumps_of(nodes: Array, noise: float) -> Array:
    """(nodes, w) what an input does between two nodes and not beside them; zero where it is smooth.

    noise: standard deviation of one node's value, roughly.
    """
    change = np.diff(nodes, axis=0, append=nodes[-1:])
    excess = change - median_filter(change, size=(5, 1), mode="nearest")
    beside = median_filter(np.abs(change), size=(5, 1), mode="nearest")
    least = np.maximum(JUMP_IN_NOISE * np.sqrt(2.0) * noise, JUMP_IN_CHANGE * beside)
    return np.where(np.abs(excess) > least, excess, 0.0)


@dataclass(frozen=True)
class NodeInput:
    """An input as the forward model takes it: at the nodes, midway between them, and how it changes."""

    values: Array  # (nodes, w) at the nodes
    middle: Array  # (nodes, w) midway to the next node, beyond the mean of both
    smooth: SmoothInput
    jumps: Array  # (nodes, w) see jumps_of
    doubt: Array  # (nodes,) variance of each component over an interval that was not sampled
    cutoff: float  # Hz up to which its noise is white; 0: it is another one in each interval (force_noise.py)
    rate_noise: float  # 1/s2, variance of its rate in that of its noise

    def between(self, first: int, last: int) -> NodeInput:
        """The input at nodes ``first`` to ``last``."""
        cut = slice(first, last + 1)
        return NodeInput(
            self.values[cut],
            self.middle[cut],
            replace(self.smooth, first=self.smooth.first + first, nodes=last + 1 - first),
            self.jumps[cut],
            self.doubt[cut],
            self.cutoff,
            self.rate_noise,
        )

    def at_every_second(self, nodes: int) -> NodeInput:
        """The same input at every second node, of which there are so many."""
        between = self.values[1::2][: nodes - 1]
        values = self.values[::2]
        middle = np.zeros_like(values)
        middle[: len(between)] = between - 0.5 * (values[:-1] + values[1:])[: len(between)]
        jumps = self.jumps[::2].copy()
        jumps[: len(self.jumps[1::2])] += self.jumps[1::2]
        smooth = replace(self.smooth, step=2.0 * self.smooth.step, first=self.smooth.first / 2, nodes=nodes)
        return replace(self, values=values, middle=middle, smooth=smooth, jumps=jumps, doubt=self.doubt[::2])

    def late_by(self, late: float) -> tuple[Array, Array, Array, Array]:
        """(nodes, w) each: the input ``late`` seconds after each node, midway, its rate, that rate's rate.

        The noise of the samples stays where it is: resampling it anew at each clock value would move the
        cost in a way that no derivative describes. What is shifted is the smoothed input, by all of it: a
        second-order expansion is off by (w d)^3 / 6, of 26 ms at 2.5 Hz by 1 % of the amplitude.
        """
        rate, bend = self.smooth.at(late, 1), self.smooth.at(late, 2)
        if late == 0.0:
            return self.values, self.middle, rate, bend
        moved = self.smooth.midway(late) - self.smooth.midway(0.0)
        return self.values + self.smooth.at(late) - self.smooth.at(0.0), self.middle + moved, rate, bend


def node_input(grid: Grid, time: Array, values: Array, noise: float) -> NodeInput:
    """Samples (n, w) as an input at the nodes; noise: standard deviation of one sample.

    The best piecewise line through dense samples of a smooth f overshoots it at the nodes by h^2 f''/12,
    which an accelerometer or a load cell would read, and through samples at the nodes alone by nothing.
    What it makes of a parabola sampled alike is taken off, and what a parabola has between two nodes is
    put back. About a jump, where f has no curvature, the line stays as it is.
    """
    line = node_values(grid, time, values)
    jumps = jumps_of(line, noise)
    at, middle = _as_curved(grid, time, line, jumps) if grid.nodes > 4 else (line, np.zeros_like(line))
    smooth, width = smoothed(grid.step, at, time, values, noise)
    of_rate = rate_noise(grid.step, width)
    return NodeInput(at, middle, smooth, jumps, np.zeros(grid.nodes), 0.0, of_rate)


def _as_curved(grid: Grid, time: Array, line: Array, jumps: Array) -> tuple[Array, Array]:
    """(nodes, w) each: an input that curves at the nodes, and midway to the next beyond both's mean."""
    rough = np.any(jumps != 0.0, axis=1)[:, None]
    rough = maximum_filter1d(rough.astype(np.int8), 9, axis=0).astype(bool)
    curved = np.zeros_like(line)
    curved[1:-1] = (line[2:] - 2.0 * line[1:-1] + line[:-2]) / grid.step**2
    nodes = grid.step * np.arange(grid.nodes)[:, None]
    over = node_values(grid, time, 0.5 * time[:, None] ** 2) - 0.5 * nodes**2
    # Where there are no samples the line is straight, and nothing is known of a curvature
    over = np.clip(over, -1.0 / 6.0 * grid.step**2, 1.0 / 6.0 * grid.step**2)
    values = np.where(rough, line, line - over * curved)
    middle = np.zeros_like(line)
    middle[1:-2] = (values[1:-2] + values[2:-1] - values[:-3] - values[3:]) / 16.0
    return values, np.where(rough, 0.0, middle)


#: Nodes between two of the samples whose weights are looked at: none reaches that far.
APART = 40


def noise_felt(grid: Grid, time: Array, samplers: Sequence[Sampler]) -> list[float]:
    """Standard deviation of the noise that an input's samples bring to the grouped samples of each sampler.

    At once, in units of what a mean over one node interval brings. Nodes come from samples on both sides,
    and groups from nodes on both sides: less of the noise is left than the interval's own.
    """
    rate = time.size / max(float(time[-1] - time[0]), grid.step)
    # One more than a whole number of nodes: each of them is at another place between its nodes
    every = round(APART * grid.step * rate) + 1
    chosen = np.arange(every // 2, time.size, every)
    impulses = np.zeros((time.size, 1))
    impulses[chosen] = 1.0
    nodes = node_input(grid, time, impulses, np.inf).values
    scale = time.size / max(1, chosen.size) * grid.step * rate
    # The mean over all groups of what every sample brings to each
    return [float(np.sqrt(scale * np.mean((sampler.at(0.0)[0] @ nodes) ** 2))) for sampler in samplers]


#: Frequencies over which a spectrum is averaged, Hz.
AVERAGED_OVER = 1.0
#: What rings is looked for in windows of this length, s, of no fewer samples than the other.
RINGING, FEW = 1.0, 16


def cubic_error(time: Array, values: Array, noise: Array, step: float) -> Array:
    """(w,) root mean square error of cubic interpolation between nodes ``step`` apart, in the values' unit.

    At angular frequency w a cubic through four nodes errs by up to 3/128 (w step)^4 of the
    amplitude, midway between two. What it makes of the samples' own noise (w,) does not count.
    """
    count = time.size
    rate = (count - 1) / max(float(time[-1] - time[0]), 1e-9)
    power = _power(values.T).T
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    width = max(1, round(AVERAGED_OVER * count / rate))
    power = uniform_filter1d(power, width, axis=0)
    # A mean over so many lines exceeds white noise's by chance up to here
    chance = 1.0 + 4.0 / np.sqrt(width)
    signal = np.maximum(power - chance * 2.0 * noise**2 / count, 0.0)
    return np.asarray(np.sqrt(np.sum(signal * _missed(frequency, step)[:, None] ** 2, axis=0)))


def worst_cubic_error(time: Array, values: Array, noise: Array, step: float) -> Array:
    """(w,) the same of the second in which it is largest, each window half over the next.

    What rings dies away: a mean over a run says nothing of its onset, and a window that fades in at the run's
    start hides it. White noise by itself comes to 0.5 to 0.8 of ``noise`` in the worst of some hundred.
    """
    rate = (time.size - 1) / max(float(time[-1] - time[0]), 1e-9)
    count = min(time.size, round(RINGING * rate))
    if count < FEW:
        return cubic_error(time, values, noise, step)
    windows = np.lib.stride_tricks.sliding_window_view(values, count, axis=0)[:: max(1, count // 2)]
    missed = _missed(np.fft.rfftfreq(count, 1.0 / rate), step) ** 2
    signal = (_power(windows) - (2.0 * noise**2 / count)[:, None]) @ missed
    return np.asarray(np.sqrt(np.maximum(0.0, np.max(signal, axis=0))))


def _power(values: Array) -> Array:
    """(..., lines) variance in each line of values (..., n), one-sided, a Hann window undone."""
    window = np.hanning(values.shape[-1])
    centred = (values - np.mean(values, axis=-1, keepdims=True)) * window
    return np.asarray(2.0 * np.abs(np.fft.rfft(centred)) ** 2 / (window.size * np.sum(window**2)))


def _missed(frequency: NDArray[np.floating[Any]], step: float) -> Array:
    """Share of a swing's amplitude, Hz, by which a cubic through nodes ``step`` apart errs at most."""
    return np.asarray(np.minimum(1.0, 3.0 / 128.0 * (2.0 * np.pi * frequency * step) ** 4))


#: Part of an interval by which one may differ from the others before samples count as uneven.
UNEVEN = 0.2
#: Stretch over which motion is a cubic to well below any sensor's noise, s.
LOCAL = 0.06


def sample_noise_std(time: Array, values: Array, local: float = LOCAL) -> Array:
    """(w,) standard deviation of what a cubic over ``local`` seconds does not follow in samples (n, w).

    Not the white part alone: a tracker's jumps and bursts count, as they do in a fit.
    """
    rate = (time.size - 1) / max(float(time[-1] - time[0]), 1e-9)
    window = max(7, 2 * int(0.5 * local * rate) + 1)
    if time.size < 2 * window:
        return np.asarray(np.std(values, axis=0) + 1e-12)
    steps = np.diff(time)
    if np.mean(np.abs(steps - np.median(steps)) > UNEVEN * np.median(steps)) > 1.0 / window:
        return _uneven_noise_std(time, values, window)
    rest = values - savgol_filter(values, window, 3, axis=0)
    # A smoother with hat matrix H leaves (1 - H_ii) of white noise's variance, H being a projection there
    kept = 1.0 - savgol_coeffs(window, 3)[window // 2]
    return np.asarray(np.std(rest, axis=0) / np.sqrt(kept))


def _uneven_noise_std(time: Array, values: Array, window: int) -> Array:
    """The same of samples that are not equidistant: what cubics through ``window`` of them each leave."""
    count = time.size // window
    at = time[: count * window].reshape(count, window)
    at = at - np.mean(at, axis=1, keepdims=True)
    reach = np.max(np.abs(at), axis=1)
    # A gap inside makes the stretch too long for a cubic
    chosen = reach < 2.0 * np.median(reach)
    powers = (at[chosen] / reach[chosen, None])[:, :, None] ** np.arange(4)
    blocks = values[: count * window].reshape(count, window, -1)[chosen]
    basis = np.linalg.qr(powers)[0]
    rest = blocks - basis @ (np.swapaxes(basis, 1, 2) @ blocks)
    return np.asarray(np.sqrt(np.sum(rest**2, axis=(0, 1)) / (rest.shape[0] * (window - 4))))
