"""The exciter's planned force, laid over the run under way: when it was begun is seen in the measured force.

An operator starts window and exciter one after the other, so the plan's time zero lies anywhere in the window
or before it. The lag is the one at which plan and measured force differ least, the plan times one factor: an
exciter that is some percent stronger than commanded is strong to the end. Where the best lag leaves much of
the measured force, the exciter does something else, and the plan tells nothing of what comes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.recording import Series

Array = NDArray[np.float64]

#: s between the nodes on which the two are compared: a fortieth of the period of 1.25 Hz.
STEP = 0.02
#: Share of the measured force's square that a plan may leave.
MOST_LEFT = 0.1
#: Share of it by which two lags are alike: of a force that repeats, every period is as good as the next.
ALIKE = 0.01


@dataclass(frozen=True)
class Begun:
    """A planned force that is being carried out."""

    recording: str  # its name in the plan
    planned: Series  # s after the exciter's start, (n, 3) N, exciter frame
    start: float  # s of the window at which the exciter began; negative: before it
    factor: float  # measured force over planned force
    left: float  # share of the measured force's square that this does not explain

    def __call__(self, time: Array) -> Array:
        """(n, 3) N at times (n,) s of the window; none before the plan begins and after it ends."""
        at, plan = np.asarray(time, dtype=float) - self.start, self.planned
        columns = [np.interp(at, plan.time, column, 0.0, 0.0) for column in plan.values.T]
        return self.factor * np.stack(columns, axis=1)


def begun(measured: Series, plans: Mapping[str, Series], name: str) -> Begun | None:
    """Which of ``plans`` the exciter carries out, and since when.

    Parameters
    ----------
    measured : Series
        Force (n, 3) N over the window so far, exciter frame.
    plans : mapping
        By the recordings' names. Where one is called ``name``, the others are not looked at.

    Returns
    -------
    Begun or None
        None where none of them explains the measured force.
    """
    chosen = {name: plans[name]} if name in plans else plans
    known = np.all(np.isfinite(measured.values), axis=1)
    if np.count_nonzero(known) < 2:
        return None
    time, values = measured.time[known], measured.values[known]
    nodes = np.arange(time[0], time[-1], STEP)
    force = _on(nodes, time, values)
    if not np.any(force):
        return None
    fits = [_laid(nodes[0], force, of, plan) for of, plan in chosen.items()]
    best = min((fit for fit in fits if fit is not None), key=lambda fit: fit.left, default=None)
    return best if best is not None and best.left <= MOST_LEFT else None


def _laid(first: float, force: Array, name: str, planned: Series) -> Begun | None:
    """The plan at its best lag. force: (n, 3) at nodes from ``first`` on."""
    plan = _on(np.arange(planned.time[0], planned.time[-1], STEP), planned.time, planned.values)
    n, m = len(force), len(plan)
    # lag k: plan[0] lies at node k; from the plan's last node at node 0 to its first at the last one
    lags = np.arange(-(m - 1), n)
    size = 1 << int(np.ceil(np.log2(n + m)))
    spectra = np.fft.rfft(force, size, axis=0) * np.conj(np.fft.rfft(plan, size, axis=0))
    product = np.sum(np.fft.irfft(spectra, size, axis=0), axis=1)[lags % size]
    squares = np.concatenate([[0.0], np.cumsum(np.sum(plan**2, axis=1))])
    seen = squares[np.clip(n - lags, 0, m)] - squares[np.clip(-lags, 0, m)]
    total = float(np.sum(force**2))
    floor = 1e-9 * squares[-1]
    if floor == 0.0:
        return None
    factor = np.maximum(product, 0.0) / np.maximum(seen, floor)
    left = 1.0 - factor * np.maximum(product, 0.0) / total
    lowest = (left <= np.append(left[1:], np.inf)) & (left <= np.insert(left[:-1], 0, np.inf))
    alike = np.flatnonzero(lowest & (left <= left.min() + ALIKE))
    k = int(alike[np.argmin(np.abs(first + lags[alike] * STEP))])
    return Begun(
        name,
        planned,
        first + float(lags[k]) * STEP - float(planned.time[0]),
        float(factor[k]),
        float(left[k]),
    )


def _on(nodes: Array, time: Array, values: Array) -> Array:
    return np.stack([np.interp(nodes, time, column) for column in values.T], axis=1)
