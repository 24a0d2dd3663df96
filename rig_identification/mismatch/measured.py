"""The motion that was measured, where the ideal model fails: a random wrench beside it stands for that.

What acts on the body is looked for along that motion, by how much of the random wrench it makes needless.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.follow import SPEED, START, followed
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.estimate.track import smoothed_from, wrench_noise
from rig_identification.model.motion import on_cables

Array = NDArray[np.float64]

#: Stds of the random wrench, over a tenth of a second, as shares of the body's weight, each weaker than the
#: one before, of which the likeliest is looked for. Beside a weaker one than the last what is fitted takes a
#: blow up.
SHARES = tuple(1e-4 * 3.0**k for k in range(6, -1, -1))
#: Rounds in which the motion is brought to what was measured.
ROUNDS = 2


def with_wrench(problem: Problem, point: Point, mass: float, share: float) -> tuple[Problem, Point] | None:
    """The problem with a random wrench beside the model, and the point at which it follows what was measured.

    None where a run cannot be followed. mass: kg, roughly. share: std of the wrench over a tenth of a
    second, in parts of the weight.
    """
    rig = problem.bench.rig
    size, step = float(np.max(extent(rig))), problem.runs[0].grid.step
    noisy = replace(problem, extra_noise=wrench_noise(mass, rig.gravity, 0.3 * size, step, share))
    there = followed(noisy, point)
    return None if there is None else (noisy, there)


def measured(problem: Problem, point: Point, mass: float) -> tuple[Problem, Evaluation] | None:
    """The problem with the likeliest random wrench, about the measured motion.

    What no wrench accounts for, such as a cable that rings, asks for none: one that is strong enough to take
    it up all the same hides what a blow is. None where a run cannot be followed. mass: kg, roughly. The
    random wrench is in the point's latents.
    """
    there = replace(point, latents=())
    found: tuple[Problem, Evaluation] | None = None
    for share in SHARES:
        wide = with_wrench(problem, there, mass, share)
        evaluation = None if wide is None else evaluate(*wide)
        if wide is None or evaluation is None or (found is not None and evaluation.cost > found[1].cost):
            break
        noisy, there = wide
        found = noisy, evaluation
    if found is None:
        return None
    for _ in range(ROUNDS):
        moved = _smoothed(*found)
        if moved is None:
            break
        found = found[0], moved
    return found


def _smoothed(problem: Problem, evaluation: Evaluation) -> Evaluation | None:
    """About the motion to which the smoother brings that of ``evaluation``, whatever it gains."""
    starts, latents = [], []
    for of, run, start, latent in zip(
        problem.runs, evaluation.runs, evaluation.point.starts, evaluation.point.latents, strict=True
    ):
        model = model_at(problem.bench.of(of).parameters, evaluation.point.theta)
        states, wrenches = smoothed_from(run, START, SPEED)
        starts.append(on_cables(model, start.moved(states[0])))
        latents.append(wrenches if latent is None else latent + wrenches)
    return evaluate(problem, replace(evaluation.point, starts=tuple(starts), latents=tuple(latents)))
