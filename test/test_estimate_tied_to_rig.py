"""On which number of the description the inertia about the vertical rests, in words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation
from test_estimate_textbook import BODY, rig, session, turned

from rig_identification.estimate.alike_threads import alike_threads
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.estimate.textbook import textbook_answers
from rig_identification.estimate.tied_to_rig import hidden_by, hidden_note, tie_of, tied_note
from rig_identification.model.equilibrium import design_pose
from rig_identification.model.motion import on_cables
from rig_identification.result import ELEMENTS, InertialEstimate, UncertaintySource

ZZ = ELEMENTS.index("Jzz")


def estimate(**variances: float) -> InertialEstimate:
    """Jzz of 0.0067 with a variance from each source, and a certain rest."""
    sources = []
    for name, variance in variances.items():
        covariance = np.zeros((10, 10))
        covariance[ZZ, ZZ] = variance
        sources.append(UncertaintySource(name.replace("__", "."), "tolerance", covariance))
    values = np.ones(10)
    values[ZZ] = 0.0067
    whole = np.asarray(sum(s.covariance for s in sources))
    return InertialEstimate(values, whole, (), tuple(sources))


def test_a_distance_known_to_a_decimetre_is_most_of_the_doubt() -> None:
    note = tied_note(estimate(tolerance__hinge_position=(0.4 * 0.0067) ** 2, noise=(0.01 * 0.0067) ** 2))
    assert note is not None
    assert "where the hinges are" in note
    assert "78 %" in note
    assert "known inertia" in note


def test_where_no_tolerance_is_most_of_it_nothing_is_told() -> None:
    assert tied_note(estimate(tolerance__hinge_position=1e-8, noise=2e-8)) is None
    unknown = estimate(tolerance__hinge_position=1e-8)
    assert tied_note(InertialEstimate(unknown.values, unknown.covariance, ("Jzz",), unknown.sources)) is None
    assert tied_note(InertialEstimate(unknown.values, unknown.covariance)) is None


def of_tolerance(**tolerance: float) -> Problem:
    """A gyroscope beside two threads that turn, described to within ``tolerance``."""
    one = rig(2, 0.2, 0.2)
    one = replace(one, tolerance={**one.tolerance, **tolerance})
    return pose_problem(session(one, turned(0.2, 0.2, 1.2, 0.1)[1]))[0]


def at_truth(problem: Problem) -> Evaluation:
    """The problem evaluated at a body that hangs midway, let go at 0.1 rad."""
    deep = np.array([1.3, 0.0, 0.0, -0.065, 0.03, 0.0, 0.0, 0.03, 0.0, 0.04])
    parameters = problem.bench.parameters
    theta = parameters.start(deep)
    model = model_at(parameters, theta)
    turn = Rotation.from_rotvec([0.0, 0.0, 0.1]).as_matrix()
    rest = design_pose(model)
    start = on_cables(model, replace(rest, R_world_body=turn @ rest.R_world_body))
    found = evaluate(problem, Point(theta, (start,), ()))
    assert found is not None
    return found


def test_the_tolerance_that_hides_the_inertia_is_the_one_without_which_it_is_known() -> None:
    problem = of_tolerance(hinge_position=0.1)
    hidden = hidden_by(problem, at_truth(problem))
    assert hidden is not None
    name, alone = hidden
    assert name == "tolerance.hinge_position"
    # What is left is the body's weight and the cables' length, not half of the inertia
    assert alone < 0.05 * 0.04
    # Without any weight nothing else that were known would help
    lost = replace(problem, mass=(1.3, 1.3))
    weightless = of_tolerance(hinge_position=1e-4)
    assert hidden_by(replace(weightless, mass=(1.3, 1e-3)), at_truth(weightless)) is not None
    assert hidden_by(lost, at_truth(lost)) is None


def test_what_hides_the_inertia_is_told_with_its_factor_and_what_breaks_the_tie() -> None:
    problem = of_tolerance(hinge_position=0.1)
    (textbook,) = textbook_answers(problem, BODY)
    threads = alike_threads(problem.bench.rig)
    assert threads is not None
    note = hidden_note("tolerance.hinge_position", 1e-4, threads, textbook)
    # J / D^2 = 0.04 / 0.16 kg; 2 hinges of 0.1 m either end at 0.2 m: 0.1 / 0.2 = 50 %; a millimetre: 0.5 %
    assert "0.250" in note
    assert "50 %" in note
    assert "0.50 %" in note
    assert "two per cent more in Jzz" in note
    assert "measure the distances between the hinges" in note
    assert "known inertia" in note
    assert "second time" in note


def test_a_fit_that_bends_the_rig_hides_no_tie() -> None:
    """Beside hinges that are known to a decimetre a fit may claim anything of the inertia."""
    wide, close = of_tolerance(hinge_position=0.1), of_tolerance(hinge_position=1e-3)
    claimed = estimate(noise=(0.01 * 0.0067) ** 2)
    told = tie_of(claimed, wide, at_truth(wide), textbook_answers(wide, BODY))
    assert told is not None
    assert told.startswith("Jzz is tied to where the hinges are. A swing tells Jzz / (d D)")
    assert tie_of(claimed, close, at_truth(close), textbook_answers(close, BODY)) is None


def test_another_tolerance_that_hides_it_is_told_without_a_formula() -> None:
    note = hidden_note("ground scale", 3e-4, None, None)
    assert "the mass" in note
    assert "3.0×10⁻⁴ kg m²" in note
    # Whatever hangs on the rig turns by its own weight
    assert "known inertia" not in note
