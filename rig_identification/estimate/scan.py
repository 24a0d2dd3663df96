"""A first guess where no tension is measured: the body's size and depth are scanned, then fitted briefly.

Without forces momentum cannot be balanced, and a wrong inertia puts the motion out of step
within a period, where a fit finds no way back. A coarse scan of two numbers (inertia as a
whole, depth of the centre of mass) over one short piece, each with its own best start
state, lands inside the basin.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import extent, headings, mocap_mount, rest_of, start_from_mocap
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Bench, model_at
from rig_identification.estimate.solve import ROUNDING, Point, Problem, solve
from rig_identification.estimate.start_state import fit_start
from rig_identification.estimate.swing_period import long_enough
from rig_identification.model.motion import State
from rig_identification.model.sensors import MOCAP_SIZE

Array = NDArray[np.float64]

#: Inertia as a multiple of the first guess, and depth as a share of the rig's extent.
SIZES = tuple(float(s) for s in np.geomspace(0.3, 4.0, 9))
DEPTHS = (0.05, 0.15, 0.4)
#: From one of the sizes to the next, and how often the scan goes on beyond them while the best is the last:
#: each time by a factor of 3.6.
RATIO, FARTHER = SIZES[1] / SIZES[0], 4
#: Piece that the scan looks at, s, taken from the middle of the second half of a run.
SCANNED = 4.0
#: Share of the weak prior's std within which the brief fit may move from the scan's best.
NEAR = 0.2


@dataclass(frozen=True)
class Scanned:
    """The best of the scan, briefly fitted."""

    problem: Problem
    theta: Array
    rest: State


@dataclass(frozen=True)
class _Tried:
    """One body under one heading, and how it fits from its best start."""

    bench: Bench
    theta: Array
    rest: State
    start: State
    heading: float
    size: float
    cost: float = np.inf


def _tried(
    problem: Problem,
    whole: Run,
    piece: Run,
    headings_: Sequence[float],
    depths: Sequence[float],
    sizes: Sequence[float],
) -> Iterator[_Tried]:
    """Every heading, depth and size, not yet fitted."""
    parameters, rig = problem.bench.parameters, problem.bench.rig
    first = parameters.elements(np.concatenate([problem.weak_center, np.zeros(parameters.size - INERTIAL)]))
    size = float(np.max(extent(rig)))
    seen = whole.R_tracker_mean is not None
    for heading in headings_:
        for depth in depths:
            elements = first.copy()
            elements[3] = np.mean([c.body_point[2] for c in rig.cables]) - depth * size
            rest = rest_of(model_at(parameters, parameters.start(elements)))
            bench: Bench = problem.bench
            if seen:
                bench = replace(bench, mocap=mocap_mount(rig, whole, rest, heading))
            for scale in sizes:
                elements[4:] = scale * first[4:]
                theta = parameters.start(elements)
                start = None
                if bench.mocap is not None:
                    model = model_at(parameters, theta)
                    start = start_from_mocap(model, piece, bench.mocap, np.zeros(MOCAP_SIZE))
                yield _Tried(bench, theta, rest, rest if start is None else start, heading, scale)


def _best(piece: Run, tried: Iterable[_Tried]) -> _Tried | None:
    """The one of what is tried that fits best, with its own best start; None where none can be followed.

    Of those that no recording tells apart the first one: rounding is no reason.
    """
    best: _Tried | None = None
    for one in tried:
        found = fit_start(one.bench, piece, one.theta, one.start, tolerance=1.0, iterations=6)
        if found is not None and (best is None or found[0].cost < best.cost - ROUNDING * abs(best.cost)):
            best = replace(one, start=found[1], cost=found[0].cost)
    return best


def _of_any_size(problem: Problem, half: Run, piece: Run, heading: float) -> _Tried | None:
    """The best over depths and SIZES, and over smaller or larger ones while the best is the last of them."""
    sizes: Sequence[float] = SIZES
    best: _Tried | None = None
    for _ in range(FARTHER):
        found = _best(piece, _tried(problem, half, piece, [heading], DEPTHS, sizes))
        if found is None or (best is not None and not found.cost < best.cost):
            break
        best = found
        if best.size == max(sizes) >= SIZES[-1]:
            sizes = [best.size * RATIO**k for k in range(1, 5)]
        elif best.size == min(sizes) <= SIZES[0]:
            sizes = [best.size / RATIO**k for k in range(1, 5)]
        else:
            break
    return best


def scan(problem: Problem, run: Run) -> Scanned | None:
    """Scan a run of ``problem``: headings at every other size first, then depths and sizes at the best one.

    None where no candidate can be followed.
    """
    nodes = run.grid.nodes
    half = run.between(nodes // 2, nodes - 1)
    piece = half.until(long_enough(half, SCANNED))
    all_headings = headings(problem.bench.rig, half) if half.R_tracker_mean is not None else [0.0]
    kept = _best(piece, _tried(problem, half, piece, all_headings, DEPTHS[1:2], SIZES[::2]))
    if kept is not None:
        kept = _of_any_size(problem, half, piece, kept.heading)
    if kept is None:
        return None
    settled = replace(problem, bench=kept.bench, runs=(run,), weak_center=kept.theta[:INERTIAL].copy())
    brief = replace(settled, runs=(piece,), rests=(), weak=NEAR * problem.weak)
    evaluation, _ = solve(brief, Point(kept.theta, (kept.start,), ()), iterations=25, tolerance=0.5)
    return Scanned(settled, evaluation.point.theta, kept.rest)
