"""Cables that stretch, told by the motion that was measured where the ideal model fails by far.

Cables that stretch by centimetres ring, and no fit without them follows: what first order promises of them
about such a fit is worth nothing. Along the measured motion (measured.py) a random wrench stands for what
the model lacks, and yet not for this: load cells and accelerometers contradict each other by as much as the
cables give. At the right stiffness they agree, at half or twice of it they do not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.solve import Evaluation, Problem, evaluate, excess, shortened
from rig_identification.estimate.stretching import usual_stiffness
from rig_identification.mismatch.amounts import CHIEF
from rig_identification.mismatch.measured import driven
from rig_identification.mismatch.screen import Promise, carried, extended
from rig_identification.mismatch.supports import cable_elasticity, gives_way
from rig_identification.mismatch.trial import VERY_FAR, promised
from rig_identification.mismatch.unbent import at_first

#: Seconds of each of the first runs that are looked at, and stiffnesses, in the usual one, that are tried:
#: from the softest by which a body in a laboratory hangs to where other witnesses tell.
LOOKED_AT, RUNS = 4.0, 2
STIFFNESSES = tuple(float(v) for v in np.geomspace(0.04, 4.0, 6))
#: Share that one of two neighbours takes away at least where the right stiffness lies between them, and the
#: share that is the right one's: a fit comes to it from half or twice of it.
TRACE, ENOUGH = 0.1, 0.9


def stretched_along(
    problem: Problem, evaluation: Evaluation, mass: float, guess: NDArray[np.float64] | None = None
) -> Promise | None:
    """Cables that stretch, at their best stiffness along the measured motion; None where they explain little.

    evaluation: of the problem's runs, longer maybe. mass: kg, roughly. guess: (p,) parameters where the ideal
    model's fit began; from where a fit without them went rigid cables come nearer than those that stretch.
    """
    model = problem.bench.parameters.model
    if gives_way(model):
        return None
    # How a body hangs is guessed where it is let go, and not amid its swing
    runs = problem.runs if guess is None else [r for r in problem.runs if r.begins[1] == 0.0]
    short = shortened(replace(problem, runs=tuple(runs[:RUNS])), LOOKED_AT)
    point = replace(evaluation.point, starts=evaluation.point.starts[:RUNS], latents=())
    about = None
    if runs:
        about = evaluate(short, point) if guess is None else at_first(short, evaluation, guess)
    rigid = None if about is None else driven(short, about.point, mass)
    if about is None or rigid is None or misfit(rigid[1]) < VERY_FAR:
        return None
    candidate = cable_elasticity(problem.bench.rig, model, mass)
    name = candidate.parameters[0].name
    wide, left = extended(short, (candidate,)), excess(rigid[1])
    usual = usual_stiffness(problem.bench.rig, mass)
    taken: dict[int, float] = {}  # share of what is left without, by stiffness

    def ask(k: int) -> None:
        if not 0 <= k < len(STIFFNESSES):
            return
        start = carried(wide, short, about.point)
        try:
            there = promised(wide, start, candidate, {name: usual * STIFFNESSES[k]}, about)
            soft = driven(wide, there, mass)
        except FloatingPointError:
            soft = None
        taken[k] = 0.0 if soft is None else 1.0 - excess(soft[1]) / left

    def best() -> int:
        return max(taken, key=lambda k: taken[k])

    # Every other one shows whether there is anything between its neighbours
    for k in (2, 4, 0):
        ask(k)
        if taken[k] > ENOUGH:
            break
    if TRACE < taken[best()] < ENOUGH:
        middle = best()
        ask(middle + 1)
        ask(middle - 1)
    share = taken[best()]
    return (
        Promise(candidate, share * left, {name: usual * STIFFNESSES[best()]}, share)
        if share > CHIEF
        else None
    )
