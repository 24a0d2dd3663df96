"""From recordings to a body: momentum, wrong guesses, what stays hidden, what may be fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from test_estimate_prediction import recorded, specification
from test_model_conservation import body_numbers, forces_on
from test_model_rigs import bifilar, four_parallel, moving, random_sample, thesis_case_14

from rig_identification.estimate.evidence import NODE_STEP, prepare
from rig_identification.estimate.first_guess import weak_prior
from rig_identification.estimate.growing import solve_growing
from rig_identification.estimate.identify import fit_session, pose_problem
from rig_identification.estimate.launch import Launch, tracked
from rig_identification.estimate.momentum import balance, momentum_map, regress, weight_map
from rig_identification.estimate.observability import elements_covariance, inertial_estimate
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Point, evaluate, on_plateau
from rig_identification.estimate.track import Track
from rig_identification.model.body import (
    elements_from_linear,
    linear_from_elements,
    linear_from_log_cholesky,
    log_cholesky_from_linear,
)
from rig_identification.model.motion import Input, simulate
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.simulate import Pulled, Truth, simulate_session
from rig_identification.simulate.at_truth import vector_at_truth
from rig_identification.simulate.start import rest_state

Array = NDArray[np.float64]


def test_momentum_is_linear_in_the_inertial_parameters() -> None:
    sample = random_sample(5, 3)
    model = sample.model(rods=True)
    motion = simulate(model, moving(sample, model, 5), Input.none(200, 0.005))
    nodes = motion.states.shape[0]
    track = Track(
        0.005 * np.arange(nodes),
        motion.states,
        motion.R_world_body,
        np.zeros((nodes, 12, 12)),
        np.zeros((nodes, 6)),
        motion.outputs,
    )
    linear = linear_from_elements(sample.elements)
    mass, center, J, gravity = body_numbers(model)
    R, w = motion.R_world_body, motion.states[:, 9:12]
    place = motion.states[:, :3] + R @ center
    p = mass * (motion.states[:, 6:9] + np.einsum("nij,nj->ni", R, np.cross(w, center)))
    h = np.cross(place, p) + np.einsum("nij,nj->ni", R, w @ J)
    np.testing.assert_allclose(momentum_map(track) @ linear, np.hstack([p, h]), atol=1e-9 * np.max(np.abs(h)))
    weight = np.tile(mass * gravity, (nodes, 1))
    moment = np.cross(place, weight)
    np.testing.assert_allclose(
        weight_map(track, gravity) @ linear, np.hstack([weight, moment]), atol=1e-9 * np.max(np.abs(moment))
    )
    # Regression on a balance that holds exactly gives the exact body, from any guess
    rate = np.gradient(momentum_map(track), 0.005, axis=0)[5:-5] - weight_map(track, gravity)[5:-5]
    rows = rate.reshape(-1, 10)
    guess = log_cholesky_from_linear(linear_from_elements(sample.elements * [1.5, 1, 1, 1, 3, 0, 0, 3, 0, 3]))
    found = regress([(rows, rows @ linear)], guess, weak_prior(sample.rig))[0]
    np.testing.assert_allclose(
        elements_from_linear(linear_from_log_cholesky(found)), sample.elements, rtol=1e-5, atol=1e-4
    )
    # Force and moment by an account of their own
    force, torque = forces_on(model, motion, np.zeros((nodes, 3)))
    change = np.gradient(np.hstack([p, h]), 0.005, axis=0)
    np.testing.assert_allclose(
        change[2:-2], np.hstack([force, torque])[2:-2], atol=5e-4 * np.max(np.abs(torque))
    )


def test_regression_recovers_the_body_from_a_noise_free_recording() -> None:
    session, truth = recorded(random_sample(5, 3), noise=False, doubts=False, duration=6.0)
    problem, _, _ = pose_problem(session)
    bench, theta = problem.bench, vector_at_truth(problem.bench.parameters, truth)
    # Without noise the finest nodes tell
    run = prepare(session.rig, session.training[0], NODE_STEP)
    found = tracked(bench, run, theta, truth.starts["run_1"])
    assert found is not None
    both = balance(found, run, bench.parameters, theta)
    assert both is not None
    wrong = theta[:INERTIAL].copy()
    wrong[1:4] += 0.5
    wrong[4:7] += 0.1
    body = elements_from_linear(linear_from_log_cholesky(regress([both], wrong, problem.weak)[0]))
    np.testing.assert_allclose(body[0], truth.elements[0], rtol=2e-3)
    np.testing.assert_allclose(body[1:4], truth.elements[1:4], atol=5e-3)
    np.testing.assert_allclose(body[[4, 7, 9]], truth.elements[[4, 7, 9]], rtol=0.02)


@pytest.mark.parametrize("factor", [0.2, 0.5, 2.0, 5.0])
def test_fit_converges_from_inertia_wrong_by(factor: float) -> None:
    session, truth = recorded(thesis_case_14(), seed=7, duration=6.0)
    problem, _, _ = pose_problem(session)
    wrong = truth.elements.copy()
    wrong[4:] *= factor
    theta = problem.bench.parameters.start(wrong)
    problem = replace(problem, weak_center=theta[:INERTIAL].copy())
    launch = Launch(problem, theta).from_rest().from_momentum()
    evaluation, converged = solve_growing(problem, launch.point())
    assert converged
    values = problem.bench.parameters.elements(evaluation.point.theta)
    std = np.sqrt(np.diag(elements_covariance(problem, evaluation)))
    assert np.max(np.abs(values - truth.elements) / std) < 4.0
    diagonal = truth.elements[[4, 7, 9]]
    np.testing.assert_allclose(values[[4, 7, 9]], diagonal, rtol=0.02)


@pytest.mark.parametrize("cables", [2, 3, 4])
def test_fit_from_no_guess_holds_the_truth(cables: int) -> None:
    session, truth = recorded(random_sample(30 + cables, cables), seed=cables, duration=6.0)
    fitted = fit_session(session)
    assert fitted.converged
    estimate = inertial_estimate(fitted.problem, fitted.evaluation)
    std = np.sqrt(np.diag(estimate.covariance))
    seen = np.array([name not in estimate.unobservable for name in ELEMENTS])
    assert np.count_nonzero(seen) >= 4
    assert np.max(np.abs(estimate.values - truth.elements)[seen] / std[seen]) < 4.0


def at_the_truth(session: Session, truth: Truth) -> InertialEstimate:
    """What the recordings can tell, apart from how it is found."""
    problem, _, _ = pose_problem(session)
    theta = vector_at_truth(problem.bench.parameters, truth)
    rest = rest_state(model_at(problem.bench.parameters, theta))
    evaluation = evaluate(problem, Point(theta, (truth.starts["run_1"],), (rest,) * len(problem.rests)))
    assert evaluation is not None
    return inertial_estimate(problem, evaluation)


def test_four_parallel_cables_hide_what_only_tilting_shows() -> None:
    # As described: half a millimetre of length that four stiff parallel cables do not share slackens one.
    # Without load cells: how inextensible cables share the load, when three would do, is undefined.
    session, truth = recorded(four_parallel(), seed=1, duration=6.0, doubts=False)
    cells = tuple(replace(recording, tension={}) for recording in session.recordings)
    session = replace(session, recordings=cells)
    estimate = at_the_truth(session, truth)
    assert {"Jxx", "Jyy", "Jxy"} <= set(estimate.unobservable)
    assert not {"Jzz", "m", "cx", "cy"} & set(estimate.unobservable)


def test_a_gentle_bifilar_pendulum_hides_rolling_about_its_span() -> None:
    """The hinge line lies along x: the body turns about the vertical and about that line, never about y.

    A product counts against the moments about its axes: without that about y it tells nothing.
    """
    spec = specification(bifilar())
    run = spec.runs[0]
    assert isinstance(run.start, Pulled)
    gentle = replace(run, start=Pulled(0.1 * run.start.force, run.start.point), force=None)
    session, truth = simulate_session(replace(spec, runs=(gentle,)), np.random.default_rng(3))
    assert at_the_truth(session, truth).unobservable == ("Jxy", "Jyy", "Jyz")


def test_a_bifilar_pendulum_is_fitted_from_no_guess() -> None:
    session, truth = recorded(bifilar(), seed=2, duration=6.0)
    fitted = fit_session(session)
    assert fitted.converged
    estimate = inertial_estimate(fitted.problem, fitted.evaluation)
    jzz = ELEMENTS.index("Jzz")
    std = np.sqrt(estimate.covariance[jzz, jzz])
    assert abs(estimate.values[jzz] - truth.elements[jzz]) < 4.0 * std


def test_no_optimum_where_nothing_answers_any_more() -> None:
    session, truth = recorded(random_sample(33, 3), seed=5, duration=2.0)
    problem, _, _ = pose_problem(session)
    rest = rest_state(model_at(problem.bench.parameters, vector_at_truth(problem.bench.parameters, truth)))

    def plateau(scale: float) -> bool:
        elements = truth.elements.copy()
        elements[4:] *= scale
        theta = problem.bench.parameters.start(elements)
        evaluation = evaluate(problem, Point(theta, (truth.starts["run_1"],), (rest,) * len(problem.rests)))
        assert evaluation is not None
        return on_plateau(evaluation)

    assert not plateau(1.0)
    assert not plateau(3.0)
    assert plateau(1e9)


def test_what_the_lab_is_certain_of_is_not_free() -> None:
    session, _ = recorded(random_sample(33, 3), seed=5, duration=2.0)
    tolerance = {
        **session.rig.tolerance,
        "imu_position": 0.0,
        "cable_length": 0.0,
        "clock": 0.0,
        "level": 0.0,
    }
    problem, theta, _ = pose_problem(replace(session, rig=replace(session.rig, tolerance=tolerance)))
    names = [p.name for p in problem.bench.parameters.free]
    certain = ("imu.position", ".length", ".clock", "level.")
    assert not [n for n in names if any(c in n for c in certain)]
    assert "imu.orientation.x" in names
    rest = rest_state(model_at(problem.bench.parameters, theta))
    evaluation = evaluate(problem, Point(theta, (rest,), (rest,) * len(problem.rests)))
    assert evaluation is not None
    assert np.all(np.isfinite(evaluation.gradient))
    assert np.all(np.linalg.eigvalsh(evaluation.information) > 0.0)


def test_the_held_out_run_touches_nothing_but_its_own_start() -> None:
    session, _ = recorded(random_sample(33, 3), seed=5, duration=5.0, holdout=True)
    spoilt = []
    for recording in session.recordings:
        if recording.holdout:
            tension = {
                name: replace(series, values=1.02 * series.values)
                for name, series in recording.tension.items()
            }
            recording = replace(recording, tension=tension)
        spoilt.append(recording)
    one = fit_session(session)
    other = fit_session(replace(session, recordings=tuple(spoilt)))
    np.testing.assert_array_equal(one.evaluation.point.theta, other.evaluation.point.theta)
    assert len(one.holdouts) == len(other.holdouts) == 1
    # It scores all the same
    rms = [float(np.sqrt(np.mean(f.holdouts[0].residual ** 2))) for f in (one, other)]
    assert rms[0] == pytest.approx(1.0, abs=0.1)
    assert rms[1] > 2.0
