"""How far (d) may be trusted with real sensors on a real rig.

A session of the case is simulated with the noise of good industrial sensors and a rig that is
not quite as described, and the estimator's whole problem, every doubt about the rig among its
unknowns, is linearised at the truth. Its inverse information is the covariance that the fit
ends with; one Gauss-Newton step from the truth is the estimate to first order in the noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.first_guess import rest_of
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.observability import elements_covariance
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import drive, model_at
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.model.body import tensor
from rig_identification.model.motion import simulate
from rig_identification.simulate import Truth, case_spec, simulate_session
from rig_identification.thesis.case import Case
from rig_identification.thesis_rerun.comparison import fitted_window

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Realistic:
    """(d) with noise and doubts."""

    std: Array  # (3, 3) kg m^2
    error_in_sigma: Array  # (3, 3) of one simulated session, to first order
    center_std: Array  # (3,) m, of the centre of mass
    seconds: float  # of motion, beside 10 s at rest and 10 s with a dummy


def realistic_uncertainty(case: Case, seed: int) -> Realistic | None:
    """Standard deviations of the tensor's elements; None where the motion cannot be linearised."""
    first, last = fitted_window(case)
    spec = case_spec(case, duration=last, holdout=False, rods=True)
    session, truth = simulate_session(spec, np.random.default_rng(seed))
    problem, _, _ = pose_problem(session)
    evaluation = _at_truth(problem, truth, first)
    if evaluation is None:
        return None
    covariance = elements_covariance(problem, evaluation)
    step = np.linalg.solve(evaluation.information, evaluation.gradient)[:INERTIAL]
    change = problem.bench.parameters.elements_jacobian(evaluation.point.theta) @ step
    std = np.sqrt(np.diag(covariance))
    return Realistic(tensor(std[4:]), tensor((change / std)[4:]), std[1:4], last - first)


def _at_truth(problem: Problem, truth: Truth, begin: float) -> Evaluation | None:
    """The problem linearised at the true rig, its runs from ``begin`` s on."""
    parameters = problem.bench.parameters
    rods = replace(parameters.model, can_slacken=np.zeros(parameters.model.cables, dtype=bool))
    parameters = replace(parameters, model=rods)
    theta = parameters.start(truth.elements)
    values = np.array([truth.parameters[p.name] for p in parameters.free])
    theta[INERTIAL:] = [(v - p.nominal) / p.prior_std for v, p in zip(values, parameters.free, strict=True)]
    model = model_at(parameters, theta)
    run = problem.runs[0]
    state = truth.starts[run.recording.name]
    node = round(begin / run.grid.step)
    if node:
        state = simulate(model, state, drive(run, parameters, theta)).state(node)
        run = run.between(node, run.grid.nodes - 1)
    rest = rest_of(model)
    posed = replace(
        problem,
        bench=replace(problem.bench, parameters=parameters),
        runs=(run,),
        weak_center=theta[:INERTIAL],
    )
    return evaluate(posed, Point(theta, (state,), (rest,) * len(problem.rests)))
