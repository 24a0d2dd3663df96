"""As much of each run as tells large effects apart: far from the noise the search looks at its first part.

What takes a wrench to be followed is told by thousands of nats over half a minute, and a search asks for ten.
A third of each run tells the same hypotheses apart, at a third of the work. It is the first part, for how a
run begins is known best: what swings within the body, follows slowly or creeps is at rest in most, and a
start in the middle of it would be one more unknown. Where the missing wrench begins late the part is longer.
Whole runs then judge what was found (whole.py), and the body's interval comes from all of them
(:func:`over_all`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.evidence import MARGIN, WIDE_NODE_STEP, Run
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.opened import carried, extended
from rig_identification.search.ladder import PASSING, STAYING, Rung, fitted_at
from rig_identification.search.path import beside

#: Length of the stretch (s): four or more swings of the slowest rigid mode of such rigs (0.37 Hz and up), so
#: that what follows displacement, velocity and acceleration parts from each other and from where the run
#: began.
SECONDS = 12.0


def stretch_of(rung: Rung) -> Rung:
    """A model with a wrench on the first part of each run; itself where runs are short."""
    if rung.problem.discrepancy is None:
        return rung
    size = np.sqrt(np.diag(rung.problem.discrepancy.covariance))
    runs, latents = [], []
    for run, linearised in zip(rung.problem.runs, rung.evaluation.runs, strict=True):
        seen = np.cumsum(np.sum((linearised.latent / size) ** 2, axis=1))
        last = max(SECONDS / run.grid.step, np.searchsorted(seen, seen[-1] * SECONDS / run.grid.duration))
        first = _with_wide_nodes(run.between(0, int(last), margin=MARGIN))
        runs.append(first)
        stride = round(first.grid.step / run.grid.step)
        latents.append(linearised.latent[: int(last) + 1 : stride][: first.grid.nodes])
    if sum(run.grid.nodes for run in runs) == _length(rung):
        return rung
    part = replace(rung.model, runs=tuple(runs))
    point = replace(rung.evaluation.point, latents=tuple(latents))
    return fitted_at(part, point, rung.level, PASSING) or rung


def over_all(whole: Rung, found: tuple[Candidate, ...], part: Rung) -> Rung:
    """A model that was fitted to a stretch, over whole runs; as it is where it cannot be followed there.

    whole: the ideal model over whole runs. part: the model with the effects ``found``, at a level with a
    wrench.
    """
    if part.alone or _length(part) == _length(whole):
        return part
    wide = extended(whole.model, found)
    point = replace(whole.evaluation.point, theta=carried(wide, part.problem, part.evaluation.point).theta)
    moved = beside(whole.problem, point, wide, whole.evaluation)
    return fitted_at(wide, moved, part.level, STAYING) or part


def _length(rung: Rung) -> int:
    """Nodes of all its runs."""
    return sum(run.grid.nodes for run in rung.problem.runs)


def _with_wide_nodes(run: Run) -> Run:
    """The run with nodes as far apart as a swing needs; what is faster is left to the wrench."""
    return run.with_wide_nodes() if 2.0 * run.grid.step <= 1.01 * WIDE_NODE_STEP else run
