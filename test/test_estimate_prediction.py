"""Residuals of a run and their exact derivatives in every free parameter, against central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from steady_zeros import steady_zeros_of_the_test  # noqa: F401
from test_model_rigs import Sample, random_sample, thesis_case_14

from rig_identification.estimate.evidence import Run, prepare
from rig_identification.estimate.first_guess import rest_of
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Linearised, linearise_run, model_at, start_basis
from rig_identification.estimate.rest_evidence import linearise_rest
from rig_identification.estimate.solve import Problem
from rig_identification.model.body import can_exist
from rig_identification.model.motion import State, on_cables
from rig_identification.recording import Dummy, Session
from rig_identification.simulate import (
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    StaticSpec,
    Truth,
    UnbalancedMass,
    simulate_session,
)
from rig_identification.simulate.at_truth import vector_at_truth

Array = NDArray[np.float64]

NOISE = {
    "tension": 2.0,
    "exciter_force": 0.5,
    "specific_force": 0.01,
    "angular_rate": 3e-4,
    "inclination": 3e-4,
    "mocap_position": 3e-4,
    "mocap_orientation": 1e-3,
}
RATES = SampleRates(tension=200.0, exciter=200.0, shaft=0.0, imu=100.0, inclinometer=50.0, ground_truth=0.0)


def specification(
    sample: Sample, *, duration: float = 6.0, holdout: bool = False, **changes: object
) -> SessionSpec:
    """Two recordings at rest and one run: let go from a side pull, shaken at 0.8 Hz."""
    weight = float(sample.elements[0]) * sample.rig.gravity
    point = sample.elements[1:4] + np.array([0.3, 0.2, 0.0])
    motor = UnbalancedMass(0.04 * weight / (2.0 * np.pi * 0.8) ** 2, 0.8, "xy", ramp=1.5)
    pull = Pulled(0.06 * weight * np.array([0.6, 0.8, 0.0]), point)
    runs = [RunSpec("run_1", duration, pull, motor)]
    if holdout:
        runs.append(
            RunSpec("run_2", duration, Pulled(-0.05 * weight * np.array([0.9, -0.3, 0.0]), point), None, True)
        )
    spec = SessionSpec(
        "sample",
        replace(sample.rig, noise=dict(NOISE)),
        sample.elements,
        runs=tuple(runs),
        statics=(
            StaticSpec("static_bare", 3.0),
            StaticSpec("static_dummy", 3.0, Dummy(0.04 * sample.elements[0], np.array([0.3, 0.2, 0.0]))),
        ),
        rates=RATES,
    )
    return replace(spec, **changes)  # type: ignore[arg-type]


def recorded(sample: Sample, seed: int = 0, **changes: object) -> tuple[Session, Truth]:
    return simulate_session(specification(sample, **changes), np.random.default_rng(seed))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def short() -> tuple[Problem, Run, Array, State]:
    """A quarter of a second of a driven run, at the truth."""
    session, truth = recorded(random_sample(21, 3), duration=1.2)
    problem, _, _ = pose_problem(session)
    run = problem.runs[0].until(0.25)
    return problem, run, vector_at_truth(problem.bench.parameters, truth), truth.starts["run_1"]


def plain(linearised: Linearised | None) -> Array:
    assert linearised is not None
    return linearised.plain


def unwhitened(linearised: Linearised | None) -> Array:
    """Jacobian of the predictions, the whitening undone where no force noise enters."""
    assert linearised is not None
    return linearised.jacobian * np.sqrt(linearised.variance)[:, None]


@pytest.mark.usefixtures("steady_zeros")
def test_every_free_parameter_of_a_run(short: tuple[Problem, Run, Array, State]) -> None:
    problem, run, theta, start = short
    run = replace(run, exciter_noise=0.0)
    bench = problem.bench
    exact = unwhitened(linearise_run(bench, run, theta, start))
    assert exact.shape[1] == theta.size + start_basis(model_at(bench.parameters, theta), start).shape[1]

    def residual(moved: Array) -> Array:
        return plain(linearise_run(bench, run, moved, on_cables(model_at(bench.parameters, moved), start)))

    names = ["inertial"] * INERTIAL + [p.name for p in bench.parameters.free]
    for column, name in enumerate(names):
        if name == "exciter.clock":
            continue  # moves the measured force, its noise included: a test of its own below
        e = np.eye(theta.size)[column]
        h = 1e-2 if column < INERTIAL else 0.5

        def central(s: float, e: Array = e) -> Array:
            return -(residual(theta + s * e) - residual(theta - s * e)) / (2.0 * s)

        numeric = (4.0 * central(h / 2.0) - central(h)) / 3.0
        size = max(float(np.max(np.abs(numeric))), 1e-6)
        error = np.max(np.abs(exact[:, column] - numeric))
        assert error <= 2e-5 * size, f"{name}: off by {error / size:.1e}"


@pytest.mark.usefixtures("steady_zeros")
def test_the_clock_of_the_exciter() -> None:
    session, truth = recorded(random_sample(21, 3), noise=False, duration=3.0)
    problem, _, _ = pose_problem(session)
    bench, run = problem.bench, replace(problem.runs[0], exciter_noise=0.0)
    theta, start = vector_at_truth(problem.bench.parameters, truth), truth.starts["run_1"]
    column = INERTIAL + [p.name for p in bench.parameters.free].index("exciter.clock")
    e = np.eye(theta.size)[column]
    exact = linearise_run(bench, run, theta, start)
    assert exact is not None
    ends = [plain(linearise_run(bench, run, theta + t * e, start)) for t in (1.0, -1.0)]
    numeric = -(ends[0] - ends[1]) / 2.0
    # The force ends with the recording: its last samples have no neighbour to move to
    inner = exact.nodes < run.grid.nodes - 20
    for channel in range(len(run.channels)):
        rows = inner & (exact.channel == channel)
        size = np.max(np.abs(numeric[rows]))
        error = np.abs(unwhitened(exact)[rows, column] - numeric[rows])
        assert np.max(error) <= 0.05 * size


@pytest.mark.usefixtures("steady_zeros")
def test_every_start_coordinate_of_a_run(short: tuple[Problem, Run, Array, State]) -> None:
    problem, run, theta, start = short
    run = replace(run, exciter_noise=0.0)
    bench = problem.bench
    basis = start_basis(model_at(bench.parameters, theta), start)
    exact = unwhitened(linearise_run(bench, run, theta, start))[:, theta.size :]
    for column in range(basis.shape[1]):

        def central(s: float, column: int = column) -> Array:
            ends = [
                plain(linearise_run(bench, run, theta, start.moved(t * basis[:, column]))) for t in (s, -s)
            ]
            return -(ends[0] - ends[1]) / (2.0 * s)

        numeric = (4.0 * central(0.05) - central(0.1)) / 3.0
        size = np.max(np.abs(numeric))
        assert np.max(np.abs(exact[:, column] - numeric)) <= 1e-6 * size


def test_every_free_parameter_at_rest(short: tuple[Problem, Run, Array, State]) -> None:
    problem, _, theta, start = short
    bench = problem.bench
    for evidence in problem.rests:
        exact = linearise_rest(bench, evidence, theta, start)
        if exact is None:
            start = rest_of(model_at(bench.parameters, theta))
            exact = linearise_rest(bench, evidence, theta, start)
        assert exact is not None
        guess = exact.rest.state
        for column in range(theta.size):
            e = np.eye(theta.size)[column]

            def central(s: float, e: Array = e, evidence=evidence, guess: State = guess) -> Array:  # type: ignore[no-untyped-def]
                ends = [linearise_rest(bench, evidence, theta + t * e, guess) for t in (s, -s)]
                assert ends[0] is not None
                assert ends[1] is not None
                return -(ends[0].residual - ends[1].residual) / (2.0 * s)

            h = 1e-2
            numeric = (4.0 * central(h / 2.0) - central(h)) / 3.0
            size = max(float(np.max(np.abs(numeric))), 1e-3)
            assert np.max(np.abs(exact.jacobian[:, column] - numeric)) <= 1e-6 * size


def test_at_the_truth_the_innovations_are_noise() -> None:
    session, truth = recorded(thesis_case_14(), seed=3)
    problem, _, _ = pose_problem(session)
    linearised = linearise_run(
        problem.bench,
        problem.runs[0],
        vector_at_truth(problem.bench.parameters, truth),
        truth.starts["run_1"],
    )
    assert linearised is not None
    r = linearised.residual
    assert np.mean(r**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / r.size))
    lag = np.corrcoef(r[linearised.channel == 0][1:], r[linearised.channel == 0][:-1])[0, 1]
    assert abs(lag) < 4.0 / np.sqrt(np.sum(linearised.channel == 0))


def test_without_noise_the_truth_explains_every_sample() -> None:
    session, truth = recorded(thesis_case_14(), noise=False)
    problem, _, _ = pose_problem(session)
    run = replace(problem.runs[0], exciter_noise=0.0)
    linearised = linearise_run(
        problem.bench, run, vector_at_truth(problem.bench.parameters, truth), truth.starts["run_1"]
    )
    assert linearised is not None
    # In units of the described noise: nothing that a sensor could show. The force ends with the recording
    inner = linearised.nodes < run.grid.nodes - 20
    assert np.max(np.abs(linearised.residual[inner])) < 0.2
    assert np.sqrt(np.mean(linearised.residual[inner] ** 2)) < 0.02


def test_parameters_keep_gravity_and_the_body_possible() -> None:
    session, truth = recorded(random_sample(2, 4), duration=1.1)
    problem, _, _ = pose_problem(session)
    parameters = problem.bench.parameters
    rng = np.random.default_rng(0)
    for _ in range(20):
        theta = vector_at_truth(problem.bench.parameters, truth) + rng.normal(size=parameters.size)
        physics = parameters.physics(theta)
        assert np.linalg.norm(physics[:3]) == pytest.approx(session.rig.gravity, rel=1e-12)
        assert can_exist(parameters.elements(theta))
    names = [p.name for p in parameters.free]
    assert len(set(names)) == len(names)


def test_a_cut_run_is_the_same_run() -> None:
    session, truth = recorded(random_sample(2, 3), duration=3.0)
    run = prepare(session.rig, session.training[0])
    cut = run.until(1.0)
    assert cut.grid.duration == pytest.approx(1.0)
    for whole, part in zip(run.channels, cut.channels, strict=True):
        assert part.time[-1] <= 1.0
        np.testing.assert_array_equal(part.values, whole.values[: part.values.shape[0]])
    problem, _, _ = pose_problem(session)
    theta = vector_at_truth(problem.bench.parameters, truth)
    one = linearise_run(problem.bench, run, theta, truth.starts["run_1"])
    other = linearise_run(problem.bench, cut, theta, truth.starts["run_1"])
    assert one is not None
    assert other is not None
    rows = other.plain.size
    # The last nodes' interpolation and input reach past the cut
    np.testing.assert_allclose(other.plain[: rows - 60], one.plain[: rows - 60], atol=1e-3)


def test_a_piece_moves_as_the_run_does_from_its_first_node_to_its_last() -> None:
    session, truth = recorded(random_sample(2, 3), duration=3.0)
    problem, _, _ = pose_problem(session)
    run, theta = prepare(session.rig, session.training[0]), vector_at_truth(problem.bench.parameters, truth)
    first, last = run.grid.nodes // 3, 2 * run.grid.nodes // 3
    whole = linearise_run(problem.bench, run, theta, truth.starts["run_1"])
    assert whole is not None
    piece = linearise_run(problem.bench, run.between(first, last), theta, whole.motion.state(first))
    assert piece is not None
    np.testing.assert_allclose(piece.motion.outputs, whole.motion.outputs[first : last + 1], atol=1e-6)
