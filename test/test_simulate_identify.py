"""Simulated, then identified: without noise the truth comes back, with noise within what is claimed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig_identification.estimate.growing import settled_starts
from rig_identification.estimate.identify import fit_session, pose_problem
from rig_identification.estimate.launch import Launch
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.estimate.solve import Evaluation, Problem, evaluate
from rig_identification.mismatch.opened import with_reference
from rig_identification.recording import Session
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.simulate import (
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    Truth,
    UnbalancedMass,
    case_spec,
    simulate_session,
)
from rig_identification.thesis import load_case

RATES = SampleRates(tension=200.0, exciter=500.0, imu=100.0, inclinometer=50.0, ground_truth=0.0)


def shaken(number: int, seconds: float = 6.0) -> SessionSpec:
    """A case of the thesis on taut cables: pulled aside, let go and shaken by an unbalanced mass."""
    spec = case_spec(load_case(number), rest=2.0, rates=RATES)
    weight = float(spec.elements[0]) * spec.rig.gravity
    pull = Pulled(0.06 * weight * np.array([0.6, 0.8, 0.0]), spec.elements[1:4] + np.array([0.3, 0.2, 0.0]))
    motor = UnbalancedMass(0.05 * weight / (2.0 * np.pi * 0.7) ** 2, 0.7, ramp=2.0)
    return replace(spec, runs=(RunSpec("run_1", seconds, pull, motor),))


def seen_by_the_true_body(spec: SessionSpec, seed: int) -> tuple[Problem, Evaluation]:
    """A session under the ideal model of the true body, its start states fitted and nothing else."""
    return at_the_true_body(*simulate_session(spec, np.random.default_rng(seed)))


def at_the_true_body(session: Session, truth: Truth) -> tuple[Problem, Evaluation]:
    """The same of a session that is there."""
    problem, theta, _ = pose_problem(session)
    launch = Launch(problem, theta).from_rest().from_momentum()
    assert launch.rest is not None
    problem = with_reference(problem, launch.rest)
    point = replace(launch.point(), theta=problem.bench.parameters.start(truth.elements))
    found = evaluate(problem, replace(point, starts=settled_starts(problem, point)))
    assert found is not None
    return problem, found


def identified(spec: SessionSpec, seed: int) -> tuple[InertialEstimate, Truth, bool]:
    session, truth = simulate_session(spec, np.random.default_rng(seed))
    assert min(truth.least_tension.values()) > 0.0
    fitted = fit_session(session)
    return inertial_estimate(fitted.problem, fitted.evaluation), truth, fitted.converged


@pytest.mark.parametrize("number", [10, 14])
def test_without_noise_the_truth_comes_back(number: int) -> None:
    """To 0.01 %: of mass, of the body's size, and of sqrt(Jii Jjj)."""
    spec = replace(shaken(number), noise=False, doubts=False)
    estimate, truth, converged = identified(spec, 1)
    assert converged
    assert estimate.unobservable == ()
    off = estimate.values - truth.elements
    assert abs(off[0]) < 1e-4 * truth.elements[0]
    assert np.max(np.abs(off[1:4])) < 1e-4 * np.max(np.abs(truth.elements[1:4]))
    xx, yy, zz = truth.elements[[4, 7, 9]]
    scale = np.sqrt([xx * xx, xx * yy, xx * zz, yy * yy, yy * zz, zz * zz])
    assert np.max(np.abs(off[4:]) / scale) < 1e-4


@pytest.mark.parametrize(("number", "seed"), [(1, 21), (10, 22), (14, 23)])
def test_with_noise_and_doubts_the_truth_lies_within_the_interval(number: int, seed: int) -> None:
    """Of ten elements each, none beyond 3.5 std: one set in two hundred has one by chance."""
    estimate, truth, converged = identified(shaken(number), seed)
    assert converged
    std = np.sqrt(np.diag(estimate.covariance))
    judged = [i for i, name in enumerate(ELEMENTS) if name not in estimate.unobservable]
    assert len(judged) >= 9
    z = (estimate.values - truth.elements)[judged] / std[judged]
    assert np.max(np.abs(z)) < 3.5
    # And the interval says something: the inertia to a percent of the largest
    assert np.max(std[4:]) < 0.01 * np.max(truth.elements[4:])


def test_steps_of_force_leave_noise_and_the_truth_in_its_interval() -> None:
    """Case 2 as the thesis prints it: 200 N come and go within a sample."""
    spec = case_spec(load_case(2), duration=10.0, rest=5.0, holdout=False)
    session, truth = simulate_session(spec, np.random.default_rng(5))
    fitted = fit_session(session)
    assert fitted.converged
    estimate = inertial_estimate(fitted.problem, fitted.evaluation)
    z = (estimate.values - truth.elements) / np.sqrt(np.diag(estimate.covariance))
    assert np.max(np.abs(z)) < 3.5
    run = fitted.problem.runs[0]
    assert run.force is not None
    jumps = np.flatnonzero(np.any(run.force.jumps != 0.0, axis=1))
    assert jumps.size >= 3
    for channel in run.channels:
        away = np.abs(channel.time[:, None] - run.grid.step * (jumps + 0.5)[None])
        assert away.min() > 2.9 * run.grid.step
    residual = fitted.evaluation.runs[0].residual
    assert np.mean(residual**2) < 1.05
