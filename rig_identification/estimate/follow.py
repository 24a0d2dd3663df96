"""What really happened: the start and the wrench noise of each run, by smoothing again and again.

A run is linearised about the motion of an undisturbed body. Where that is not what happened, because the
wrench noise is large or because the motion answers sharply to it (a spring that hardens makes of a newton's
error at the beginning another motion ten seconds later), steps about it lead nowhere. The smoother gives the
noise that brings the motion to what was measured; held by the nominal motion, the run is linearised about
that, and smoothed once more (an iterated fixed-interval smoother: Bell, SIAM J. Optimization 4, 1994).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.prediction import Linearised, linearise_run, model_at
from rig_identification.estimate.solve import Point, Problem
from rig_identification.estimate.track import smoothed_from
from rig_identification.model.motion import State, on_cables

Array = NDArray[np.float64]

#: Rounds in which a motion settles, and the part of a step below which none is tried.
ROUNDS, SHORTEST = 6, 0.1
#: Std (m and rad; m/s and rad/s) of a start about where it is known to be.
START, SPEED = 0.005, 0.02
#: Gain (nats) of a round below which the motion has settled.
SETTLED = 0.1


def followed(problem: Problem, point: Point) -> Point | None:
    """The point with the starts and the wrench noise with which each run is followed; None: one cannot be."""
    starts, latents = [], []
    before = point.latents or (None,) * len(problem.runs)
    for run, start, latent in zip(problem.runs, point.starts, before, strict=True):
        held = np.zeros((run.grid.nodes, 6)) if latent is None else latent
        there = _followed(problem, run, point.theta, start, held)
        if there is None:
            return None
        starts.append(there[0])
        latents.append(there[1])
    return replace(point, starts=tuple(starts), latents=tuple(latents))


def _followed(
    problem: Problem, run: Run, theta: Array, start: State, held: Array
) -> tuple[State, Array] | None:
    """Start and noise (N, 6) of one run. A step that leaves more than before is tried at half its length."""
    bench, noise = problem.bench.of(run), problem.extra_noise
    model = model_at(bench.parameters, theta)

    def at(start: State, held: Array) -> Linearised | None:
        return linearise_run(bench, run, theta, start, start_only=True, extra_noise=noise, latent=held)

    seen = at(start, held)
    if seen is None:
        return None
    for _ in range(ROUNDS):
        states, wrenches = smoothed_from(seen, START, SPEED)
        length, won = 1.0, 0.0
        while length > SHORTEST and won <= 0.0:
            moved = on_cables(model, start.moved(length * states[0]))
            tried = at(moved, held + length * wrenches)
            if tried is not None and tried.cost < seen.cost:
                won = seen.cost - tried.cost
                start, held, seen = moved, held + length * wrenches, tried
            length *= 0.5
        if won < SETTLED:
            break
    return start, held
