"""A step moves the body along the straight line of its ten numbers."""

from __future__ import annotations

import numpy as np
from test_estimate_prediction import recorded
from test_model_rigs import bifilar

from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.parameters import INERTIAL, THINNER


def test_a_long_step_leaves_alone_what_it_leaves_alone_to_first_order() -> None:
    problem, theta, _ = pose_problem(recorded(bifilar(), duration=2.0)[0])
    parameters = problem.bench.parameters
    jacobian = parameters.elements_jacobian(theta)
    before = parameters.elements(theta)
    # A step that to first order makes Jxx smaller by a fifth and changes no other number
    wanted = np.zeros(INERTIAL)
    wanted[4] = -0.2 * before[4]
    change = np.zeros(parameters.size)
    change[:INERTIAL] = np.linalg.solve(jacobian, wanted)
    np.testing.assert_allclose(
        parameters.elements(parameters.moved(theta, change)), before + wanted, rtol=1e-9, atol=1e-9
    )


def test_no_step_leads_to_a_body_that_cannot_exist() -> None:
    problem, theta, _ = pose_problem(recorded(bifilar(), duration=2.0)[0])
    parameters = problem.bench.parameters
    before = parameters.elements(theta)
    wanted = np.zeros(INERTIAL)
    wanted[4] = -5.0 * before[4]
    change = np.zeros(parameters.size)
    change[:INERTIAL] = np.linalg.solve(parameters.elements_jacobian(theta), wanted)
    moved = parameters.moved(theta, change)
    # The step is made in the vector itself, in which every number is a body
    np.testing.assert_array_equal(moved, theta + change)
    assert parameters.elements(moved)[4] > 0.0
    assert THINNER > 1.0
