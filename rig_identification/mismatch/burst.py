"""A push beside anything else, told by the wrench that the measured motion asks for.

Where the ideal model fails by far no short piece is left in peace: a rotor that the scale did not weigh bends
rest and motion everywhere, and a push among that is one bad piece of many. The random wrench that brings the
model to the measured motion (measured.py) is another matter. What is wrong all the time is in it all the
time, mostly as a constant; what pushes for a second is in it for that second.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.locate import Event, event_in
from rig_identification.mismatch.measured import driven
from rig_identification.mismatch.trial import mass_of

Array = NDArray[np.float64]

#: Seconds over which the wrench is averaged.
BIN = 0.25
#: A push stands out of the wrench at all other times by this factor (of its square), in one stretch of so
#: much of the time at most: what swings, rubs or lags comes to as much again and again.
STANDS_OUT, FOR = 5.0, 0.2
#: Bins on either side of what stands out in which it may begin and end.
ABOUT = 2


def burst(problem: Problem, evaluation: Evaluation) -> Event | None:
    """The pieces in which something pushes for a while; None where the missing wrench is no such burst.

    problem: short pieces; evaluation: the model's fit to them, however far off.
    """
    seen = driven(problem, evaluation.point, mass_of(problem, evaluation))
    if seen is None or seen[0].extra_noise is None:
        return None
    size = np.sqrt(np.diag(seen[0].extra_noise))
    rows, piece = [], []
    for i, (run, latent) in enumerate(zip(problem.runs, seen[1].point.latents, strict=True)):
        if latent is None:
            return None
        bins = max(1, int(run.grid.duration / BIN))
        rows += [np.mean(part, axis=0) / size for part in np.array_split(latent, bins)]
        piece += [i] * bins
    wrench = np.array(rows)
    stretch = standing_out(np.sum((wrench - np.median(wrench, axis=0)) ** 2, axis=1))
    if stretch is None:
        return None
    names = [problem.runs[i].recording.name for i in piece]
    first, last = stretch[0] - ABOUT, stretch[1] + ABOUT
    if first < 0 or last > len(piece) or len(set(names[first:last])) > 1:
        # What begins or dies away stands out at a recording's end as well
        return None
    return event_in(problem, sorted(set(piece[first:last])), evaluation.point)


def standing_out(squares: Array) -> tuple[int, int] | None:
    """First bin, and the one after the last, of the one stretch that stands out; None where none does."""
    high = np.flatnonzero(squares > np.max(squares) / STANDS_OUT)
    first, last = int(high[0]), int(high[-1]) + 1
    return (first, last) if last - first <= FOR * squares.size else None
