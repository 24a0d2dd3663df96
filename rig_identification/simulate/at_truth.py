"""Where the estimator's unknowns truly are in a simulated session: where a study of the estimator begins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.parameters import INERTIAL, ParameterSet
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Point, Problem
from rig_identification.simulate.session import Truth
from rig_identification.simulate.start import rest_state


def vector_at_truth(parameters: ParameterSet, truth: Truth) -> NDArray[np.float64]:
    """The optimiser's vector, of the body and of every doubt about the rig."""
    theta = parameters.start(truth.elements)
    for i, p in enumerate(parameters.free):
        theta[INERTIAL + i] = (truth.parameters[p.name] - p.nominal) / p.prior_std
    return theta


def point_at_truth(problem: Problem, truth: Truth) -> Point:
    """Every unknown of a problem of whole runs, with its rest pose. Raises InputError where there is none."""
    parameters = problem.bench.parameters
    theta = vector_at_truth(parameters, truth)
    rest = rest_state(model_at(parameters, theta))
    starts = tuple(truth.starts[run.recording.name] for run in problem.runs)
    return Point(theta, starts, (rest,) * len(problem.rests))
