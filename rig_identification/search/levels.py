"""How strong the wrench may be that a model lacks: a few levels, from what carries anything to none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.force_noise import Discrepancy
from rig_identification.estimate.solve import Problem

Array = NDArray[np.float64]

#: Standard deviation of the force as a share of the body's weight, level by level, about half a decade apart:
#: the evidence changes by the logarithm of the level, and its maximum is flat over as much.
LEVELS = (0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 0.0)
#: The level at which the wrench is none, and the model stands alone.
ALONE = len(LEVELS) - 1
#: Radius of gyration of a vehicle in parts of the longest distance between two hinges of its body.
GYRATION = 0.3


def at_level(problem: Problem, mass: float, level: int) -> Problem:
    """The problem with a discrepancy of that level. mass: of the body, kg, roughly.

    It is forgotten within 1/w of the body's own swing at angular frequency w, and so as strong at every
    frequency up to that: a hose, a liquid, a spring act where the body swings.
    """
    share = LEVELS[level]
    if share == 0.0:
        return replace(problem, discrepancy=None)
    rig = problem.bench.rig
    force = share * mass * rig.gravity
    arm = GYRATION * float(np.max(extent(rig)))
    swing = float(np.sqrt(np.mean([cable.length for cable in rig.cables]) / rig.gravity))
    return replace(problem, discrepancy=Discrepancy(force, force * arm, swing))
