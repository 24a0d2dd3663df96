"""The exciter's force without what is noise alone.

The model is driven by the force as its cells read it, and their noise drives it too. Where the true force has
no power that is all that drives it, and what rings there, a ceiling or cables that stretch, answers: a cell's
noise of 0.5 N rings a ceiling of 16 Hz as loudly as half a load cell's own noise. To charge the residuals
with it (whitening.py) takes each reading for the true force give or take the noise, as likely one way as
another (Berkson), while of a smooth force it is the reading that errs: the true one is known to be still
where only noise is heard. So told, noise is claimed that no residual shows, and a fit
that weighs the claim makes what rings heavier, for then it rings less: of a ceiling of 7.3 MN/m and 111 kg
12.2 MN/m and 709 kg, its squared residuals larger by one nat and its claim smaller by seven (12849).

A force without jumps and gaps is therefore a penalised cubic spline (P-spline: Eilers and Marx, Statistical
Science 11, 1996) with fourth differences, of which a frequency f keeps 1/(1 + (f/c)^8): 1e-5 is lost at a
quarter of c, and a thousandth of the noise's power is left at one and a half times c. c is the lowest at
which the samples' noise is all that the spline leaves. The noise that it keeps is white up to about c
(band_limited.py).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, CubicSpline
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from rig_identification.estimate.band_limited import highest_cutoff
from rig_identification.estimate.sampling import Grid, NodeInput, sample_noise_std
from rig_identification.estimate.smoothing import SmoothInput, noise_alone

Array = NDArray[np.float64]

#: Frequencies c (Hz) that are tried, a third of an octave apart, as far as nodes can hold their noise.
CUTOFFS = 3.0 * 2.0 ** (np.arange(11) / 3.0)
#: What is left at the lowest that leaves noise alone may still hide a trace; c is taken by so much higher,
#: which leaves a sixth of a line.
HIGHER = 1.25
#: Factor on the noise that is estimated from the samples themselves, which is off by some percents.
QUIETER = 1.1
#: Fewest samples of a force that is smoothed.
FEW = 64


def smooth_force(grid: Grid, time: Array, values: Array, noise: Array) -> NodeInput | None:
    """Samples (n, w) of a smooth force as an input; None where no spline leaves their noise alone.

    noise (w,): standard deviation of one sample, each component.
    """
    inside = (time >= 0.0) & (time <= grid.duration)
    time, values = time[inside], values[inside]
    if time.size < FEW or grid.nodes < FEW:
        return None
    # A recording may be quieter than described: what its samples do not jump about by is no noise
    noise = np.minimum(noise, QUIETER * sample_noise_std(time, values))
    if not np.all(noise > 0.0):
        return None
    splines = _Splines(grid, time)
    for cutoff in CUTOFFS[highest_cutoff(grid.step) / HIGHER >= CUTOFFS]:
        left = values - splines.design @ splines.fitted(values, cutoff)
        if noise_alone(time, left / noise, cutoff):
            return _input(splines, splines.fitted(values, HIGHER * cutoff), HIGHER * cutoff)
    return None


class _Splines:
    """Cubic B-splines with a knot at each node."""

    def __init__(self, grid: Grid, time: Array) -> None:
        self.grid = grid
        self.knots = grid.step * np.arange(-3.0, grid.nodes + 3.0)
        self.design = csc_array(BSpline.design_matrix(time, self.knots, 3))
        self._normal = self.design.T @ self.design
        count = self.design.shape[1]
        fourth = diags_array([1.0, -4.0, 6.0, -4.0, 1.0], offsets=range(5), shape=(count - 4, count))
        self._bent = fourth.T @ fourth
        self._samples = time.size / grid.nodes

    def fitted(self, values: Array, cutoff: float) -> Array:
        """(nodes + 2, w) coefficients of the spline that keeps half of ``cutoff`` Hz."""
        # Fourth differences of a wave are (2 sin(w h / 2))^4 of it
        stiff = self._samples / (2.0 * np.sin(np.pi * cutoff * self.grid.step)) ** 8
        return np.asarray(splu(csc_array(self._normal + stiff * self._bent)).solve(self.design.T @ values))

    def at(self, coefficients: Array) -> Array:
        """(nodes, w) values at the nodes."""
        nodes = self.grid.step * np.arange(self.grid.nodes)
        return np.asarray(BSpline(self.knots, coefficients, 3)(nodes))


def _input(splines: _Splines, coefficients: Array, cutoff: float) -> NodeInput:
    grid = splines.grid
    values = splines.at(coefficients)
    spline = CubicSpline(grid.step * np.arange(grid.nodes), values)
    smooth = SmoothInput(spline, grid.step, 0, grid.nodes)
    middle = np.zeros_like(values)
    middle[:-1] = smooth.at(0.0, between=0.5)[:-1] - 0.5 * (values[1:] + values[:-1])
    return NodeInput(
        values,
        middle,
        smooth,
        np.zeros_like(values),
        np.zeros(grid.nodes),
        cutoff,
        float((2.0 * np.pi * cutoff) ** 2 / 3.0),
    )
