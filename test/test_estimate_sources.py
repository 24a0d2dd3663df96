"""The covariance by source: rows that add up, and the same as a dense calculation of the budget gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from steady_zeros import steady_zeros_of_the_test  # noqa: F401

from rig_identification.estimate.force_noise import Discrepancy
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.observability import elements_covariance, inertial_estimate
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Linearised, model_at
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.estimate.sources import RIVALS, sources, undone, with_sources
from rig_identification.estimate.without_frame import subtract_frame
from rig_identification.rig import CarryingFrame
from rig_identification.simulate import SampleRates, case_spec, simulate_session
from rig_identification.simulate.start import rest_state
from rig_identification.thesis import load_case

RATES = SampleRates(tension=50.0, exciter=100.0, imu=50.0, inclinometer=25.0, ground_truth=0.0)


@pytest.fixture(scope="module")
def posed() -> tuple[Problem, Evaluation]:
    """A short session of the thesis' rig, linearised at its truth."""
    spec = case_spec(load_case(10), duration=3.0, rest=2.0, holdout=False, rates=RATES, doubts=False)
    session, truth = simulate_session(spec, np.random.default_rng(3))
    problem, _, _ = pose_problem(session)
    theta = problem.bench.parameters.start(truth.elements)
    rest = rest_state(model_at(problem.bench.parameters, theta))
    starts = tuple(truth.starts[run.recording.name] for run in problem.runs)
    evaluation = evaluate(problem, Point(theta, starts, (rest,) * len(problem.rests)))
    assert evaluation is not None
    return problem, evaluation


def dense_covariance(linearised: Linearised) -> np.ndarray:
    """(m, m) of a run's samples, built up from every draw of the noise that drives it."""
    noise, A = linearised.noise, linearised.motion.derivatives[0]
    rows, nodes = linearised.nodes.size, A.shape[0]
    states, width = A.shape[1], noise.through.shape[2]
    covariance = np.diag(linearised.variance)
    carried = np.kron(noise.follow, np.eye(3)) if noise.follow.size else np.zeros((width, width))
    for drawn in range(nodes):
        Q = noise.Q[min(drawn, noise.Q.shape[0] - 1)]
        if not np.any(Q):
            continue
        effect, x, w = np.zeros((rows, width)), np.zeros((states, width)), np.eye(width)
        for k in range(drawn, nodes):
            here = linearised.nodes == k
            effect[here] = linearised.row_H[here] @ x + noise.felt[here] @ w
            x, w = A[k] @ x + noise.through[k] @ w, carried @ w
        covariance += effect @ Q @ effect.T
    return covariance


def of_first_rows(linearised: Linearised, nodes: int) -> Linearised:
    """The run's first nodes, so that a dense covariance stays small."""
    kept = linearised.nodes < nodes
    motion = replace(
        linearised.motion,
        **{k: d[:nodes] for k, d in zip("ABHDJ", linearised.motion.derivatives, strict=True)},
    )
    noise = replace(
        linearised.noise, felt=linearised.noise.felt[kept], through=linearised.noise.through[:nodes]
    )
    cut = {
        name: getattr(linearised, name)[kept]
        for name in (
            "residual",
            "jacobian",
            "nodes",
            "channel",
            "axis",
            "plain",
            "variance",
            "row_H",
            "row_D",
        )
    }
    wander = linearised.wander._replace(responses=linearised.wander.responses[kept])
    latent = linearised.latent[:nodes]
    return replace(linearised, motion=motion, noise=noise, latent=latent, wander=wander, **cut)


@pytest.mark.usefixtures("steady_zeros")
def test_whitening_taken_back_is_the_inverse_covariance(posed: tuple[Problem, Evaluation]) -> None:
    """W^T W = S^-1: of the whitened residual that is S^-1 times the residual as it was."""
    problem, evaluation = posed
    again = evaluate(problem, evaluation.point)
    assert again is not None
    run = of_first_rows(again.runs[0], 40)
    expected = np.linalg.solve(dense_covariance(run), run.plain)
    assert np.allclose(
        undone(run, run.residual[:, None])[:, 0], expected, rtol=1e-7, atol=1e-9 * np.max(np.abs(expected))
    )


def test_the_rows_add_up(posed: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = posed
    total = with_sources(inertial_estimate(problem, evaluation), problem, evaluation)
    told = np.sum([np.diag(s.covariance) for s in total.sources], axis=0)
    assert np.max(np.abs(told / np.diag(total.covariance) - 1.0)) < 1e-9
    assert {s.kind for s in total.sources} == {"noise", "rest", "tolerance", "scale", "belief"}
    for source in total.sources:
        assert np.all(np.diag(source.covariance) > -1e-9 * np.diag(total.covariance)), source.name


def test_each_row_is_what_its_input_does(posed: tuple[Problem, Evaluation]) -> None:
    """A tolerance's row: what the estimate moves by when the described values move, C P e, drawn at once."""
    problem, evaluation = posed
    inverse = np.linalg.inv(evaluation.information)
    map_ = problem.bench.parameters.elements_jacobian(evaluation.point.theta)
    free = problem.bench.parameters.free
    moved = np.zeros((10, 10))
    for column, parameter in enumerate(free, start=INERTIAL):
        if parameter.name.endswith(".length"):
            step = map_ @ inverse[:INERTIAL, column]
            moved += np.outer(step, step)
    row = {s.name: s.covariance for s in sources(problem, evaluation)}["tolerance.cable_length"]
    assert np.allclose(row, moved, rtol=1e-5, atol=1e-8 * np.max(np.diag(moved)))


def test_the_exciters_noise_is_what_its_force_leaves(posed: tuple[Problem, Evaluation]) -> None:
    """Without noise of the exciter's cells its row is gone, and the whole is smaller."""
    problem, evaluation = posed
    quiet = replace(problem, runs=tuple(replace(r, exciter_noise=0.0) for r in problem.runs))
    again = evaluate(quiet, evaluation.point)
    assert again is not None
    loud, still = sources(problem, evaluation), sources(quiet, again)
    assert "exciter force" in {s.name for s in loud}
    assert "exciter force" not in {s.name for s in still}
    assert np.trace(elements_covariance(quiet, again)) < np.trace(elements_covariance(problem, evaluation))


def test_a_random_wrench_has_a_row(posed: tuple[Problem, Evaluation]) -> None:
    """... in motion and at rest, and what it hides is in no channel's row."""
    problem, evaluation = posed
    lacking = replace(problem, discrepancy=Discrepancy(5.0, 5.0, 0.5))
    there = evaluate(lacking, evaluation.point)
    assert there is not None
    total = with_sources(inertial_estimate(lacking, there), lacking, there)
    rows = {s.name: np.diag(s.covariance) for s in total.sources}
    assert rows["exciter force and random wrench"][4] > 0.1 * total.covariance[4, 4]
    assert RIVALS not in rows
    for name, row in rows.items():
        assert np.all(row > -1e-8 * np.diag(total.covariance)), name


def test_what_rivals_add_stands_in_a_row(posed: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = posed
    alone = inertial_estimate(problem, evaluation)
    total = with_sources(replace(alone, covariance=3.0 * alone.covariance), problem, evaluation, 2.0)
    rows = {s.name: s.covariance for s in total.sources}
    assert np.allclose(rows[RIVALS], alone.covariance, rtol=1e-6)
    assert np.allclose(sum(rows.values()), total.covariance, rtol=1e-12)


def test_the_frame_is_a_source(posed: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = posed
    total = with_sources(inertial_estimate(problem, evaluation), problem, evaluation)
    frame = CarryingFrame(50.0, np.array([0.5, 0.5, 0.0]), np.diag([10.0, 10.0, 15.0]))
    alone = subtract_frame(total, frame)
    told = np.sum([np.diag(s.covariance) for s in alone.sources], axis=0)
    assert alone.sources[-1].kind == "frame"
    assert np.max(np.abs(told / np.diag(alone.covariance) - 1.0)) < 1e-9
