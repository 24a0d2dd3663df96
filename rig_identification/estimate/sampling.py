"""From node values to sample times: interpolation, grouping and input reconstruction as linear maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.ndimage import gaussian_filter1d, median_filter
from scipy.signal import savgol_coeffs, savgol_filter
from scipy.sparse import csr_matrix

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


def _stencil(grid: Grid, time: Array) -> tuple[Index, Array, Array]:
    """First node (n,), weights (n, 4) and their time derivatives (n, 4) of cubic Lagrange interpolation."""
    first = np.clip(np.floor(time / grid.step).astype(np.int64) - 1, 0, grid.nodes - 4)
    s = time / grid.step - first
    nodes = np.arange(4.0)
    weights = np.ones((time.size, 4))
    slopes = np.zeros((time.size, 4))
    for j in range(4):
        others = [k for k in range(4) if k != j]
        scale = np.prod([nodes[j] - k for k in others])
        factors = np.stack([s - k for k in others], axis=1)
        weights[:, j] = np.prod(factors, axis=1) / scale
        for omit in range(3):
            slopes[:, j] += np.prod(np.delete(factors, omit, axis=1), axis=1) / scale
    return first, weights, slopes / grid.step


def interpolation(grid: Grid, time: Array, group: Index, groups: int) -> tuple[csr_matrix, csr_matrix]:
    """Matrices (groups, nodes): mean over each group of the interpolated value, and of its rate."""
    first, weights, slopes = _stencil(grid, time)
    share = 1.0 / np.bincount(group, minlength=groups)[group]
    rows = np.repeat(group, 4)
    columns = (first[:, None] + np.arange(4)).ravel()
    shape = (groups, grid.nodes)
    value = csr_matrix(((weights * share[:, None]).ravel(), (rows, columns)), shape=shape)
    slope = csr_matrix(((slopes * share[:, None]).ravel(), (rows, columns)), shape=shape)
    return value, slope


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


def rate_of_change(grid: Grid, nodes: Array, smoothing: float = 0.015) -> Array:
    """(nodes, w) time derivative of a noisy input, smoothed over ``smoothing`` seconds."""
    return np.asarray(np.gradient(gaussian_filter1d(nodes, smoothing / grid.step, axis=0), grid.step, axis=0))


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
    rest = values - savgol_filter(values, window, 3, axis=0)
    # A smoother with hat matrix H leaves (1 - H_ii) of white noise's variance, H being a projection there
    kept = 1.0 - savgol_coeffs(window, 3)[window // 2]
    return np.asarray(np.std(rest, axis=0) / np.sqrt(kept))
