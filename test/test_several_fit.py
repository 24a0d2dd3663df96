"""Joint information of a real fit: what it says of the body is what the fit says."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bench.several import FIRST, poses
from rig_identification.estimate import side_by_side
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.joint_information import joint_information
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.origins import Origins, told
from rig_identification.estimate.solve import Evaluation, Problem, solve
from rig_identification.recording import Session
from rig_identification.report.joint_json import joint_to_dict
from rig_identification.result import Identification, Mismatch
from rig_identification.several.fuse import fuse
from rig_identification.several.session_result import SessionResult
from rig_identification.simulate import Truth, simulate_session
from rig_identification.simulate.at_truth import point_at_truth

GIVEN = {"cable_1.length": 1.5, "imu.gyroscope_scale.x": -0.5}
READING = 1100.4


@pytest.fixture(scope="module")
def simulated() -> tuple[Session, Truth]:
    spec = poses()[FIRST]
    spec = replace(spec, given_doubts=GIVEN, scale_reading=READING)
    spec = replace(spec, runs=tuple(replace(run, duration=4.0) for run in spec.runs))
    return simulate_session(spec, np.random.default_rng(3))


@pytest.fixture(scope="module")
def fitted(simulated: tuple[Session, Truth]) -> tuple[Session, Problem, Evaluation]:
    session, truth = simulated
    problem, _, _ = pose_problem(session)
    evaluation, converged = solve(problem, point_at_truth(problem, truth))
    assert converged
    return session, problem, evaluation


def answer(session: Session, problem: Problem, evaluation: Evaluation) -> SessionResult:
    joint = joint_information(session, problem, evaluation)
    return SessionResult("one", inertial_estimate(problem, evaluation), "none", (), joint)


def test_a_session_of_a_known_rig_is_simulated(simulated: tuple[Session, Truth]) -> None:
    session, truth = simulated
    assert truth.parameters["cable_1.length"] - truth.described["cable_1.length"] == pytest.approx(
        1.5 * session.rig.tolerance["cable_length"]
    )
    assert truth.parameters["imu.gyroscope_scale.x"] == pytest.approx(-0.5 * 1e-3)
    assert session.rig.mass == READING


def test_the_posterior_is_the_fits(fitted: tuple[Session, Problem, Evaluation]) -> None:
    one = answer(*fitted)
    std = np.sqrt(np.diag(one.estimate.covariance))
    scale = np.outer(std, std)
    np.testing.assert_allclose(one.posterior[:10, :10] / scale, one.estimate.covariance / scale, atol=1e-6)
    assert np.max(np.abs(one.excess) / scale) < 1e-8
    assert one.joint is not None
    assert np.all(np.diag(one.posterior)[10:] < 1.0 + 1e-9), "no recording makes a doubt greater"


def test_one_session_fused_is_that_session(fitted: tuple[Session, Problem, Evaluation]) -> None:
    """The priors that are taken off are those that were in the fit."""
    one = answer(*fitted)
    total = fuse([one]).total
    std = np.sqrt(np.diag(one.estimate.covariance))
    np.testing.assert_allclose((total.values - one.values) / std, 0.0, atol=1e-3)
    np.testing.assert_allclose(np.sqrt(np.diag(total.covariance)) / std, 1.0, atol=1e-4)


def test_the_same_session_twice_is_no_independent_one(fitted: tuple[Session, Problem, Evaluation]) -> None:
    """Noise of two such sessions would average; what they share does not."""
    one = answer(*fitted)
    total = fuse([one, replace(one, name="two")]).total
    ratio = np.sqrt(np.diag(total.covariance) / np.diag(one.estimate.covariance))
    assert np.all(ratio > np.sqrt(0.5) - 1e-6)
    assert np.any(ratio > 0.8), "the rig's tolerances must not average away"


def test_other_origins_move_places_and_nothing_else(fitted: tuple[Session, Problem, Evaluation]) -> None:
    one = answer(*fitted)
    assert one.joint is not None
    origins = Origins(np.array([10.0, 0.0, 0.0]), np.array([0.0, 20.0, 0.0]))
    found = Identification(
        one.estimate, None, Mismatch("none", ""), (), (), None, None, True, joint=one.joint
    )
    moved = told(found, origins).joint
    assert moved is not None
    np.testing.assert_array_equal(moved.root, one.joint.root)
    assert moved.elements[1] == pytest.approx(one.joint.elements[1] + 10.0)
    assert moved.mounts["imu"][0] == pytest.approx(one.joint.mounts["imu"][0] + 10.0)
    assert moved.ceiling["cable_2"][1] == pytest.approx(one.joint.ceiling["cable_2"][1] + 20.0)
    nominal = {d.name: d.nominal for d in one.joint.doubts}
    shift = {d.name: d.nominal - nominal[d.name] for d in moved.doubts}
    assert shift["cable_1.body_point.x"] == pytest.approx(10.0)
    assert shift["cable_1.ceiling_point.y"] == pytest.approx(20.0)
    assert shift["imu.position.x"] == 0.0


def test_it_is_small(fitted: tuple[Session, Problem, Evaluation]) -> None:
    assert len(json.dumps(joint_to_dict(joint_information(*fitted)), indent=2)) < 60_000


def test_a_process_takes_its_share_of_the_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(side_by_side.SHARE, "1")
    assert side_by_side.cores() == 1
    monkeypatch.setenv(side_by_side.SHARE, "many")
    assert side_by_side.cores() >= 1
