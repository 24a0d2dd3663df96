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
from rig_identification.mismatch.locate import Event
from rig_identification.mismatch.measured import driven
from rig_identification.mismatch.trial import mass_of

Array = NDArray[np.float64]

#: Seconds over which the wrench is averaged.
BIN = 0.25
#: A push holds this share of what is no constant in the wrench (its square), in so much of the time at most:
#: what swings, rubs or lags takes the larger part of the time to come to as much.
HELD, FOR = 0.9, 0.2


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
    squares = np.sum((wrench - np.median(wrench, axis=0)) ** 2, axis=1)
    first, last = _shortest(squares)
    names = {problem.runs[i].recording.name for i in piece[first:last]}
    if last - first > FOR * squares.size or len(names) > 1:
        return None
    bad = sorted(set(piece[first:last]))
    calm = tuple(i for i in range(len(problem.runs)) if i not in bad)
    start, end = problem.runs[bad[0]], problem.runs[bad[-1]]
    return Event(names.pop(), start.offset, end.offset + end.grid.duration, evaluation.point, calm)


def _shortest(squares: Array) -> tuple[int, int]:
    """First bin, and the one after the last, of the shortest stretch that holds ``HELD`` of the sum."""
    total = np.concatenate([[0.0], np.cumsum(squares)])
    ends = np.searchsorted(total, total[:-1] + HELD * total[-1])
    lengths = np.where(ends < total.size, ends - np.arange(squares.size), total.size)
    first = int(np.argmin(lengths))
    return first, int(min(ends[first], squares.size))
