"""Steps of the fit: the best one within every bound, whatever direction Newton's points in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from test_estimate_prediction import recorded
from test_model_rigs import random_sample

from rig_identification.estimate import solve as fitting
from rig_identification.estimate.box import in_box
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import (
    Evaluation,
    Point,
    Problem,
    _bounded_step,
    _pulled_back,
    evaluate,
    moved_by,
)
from rig_identification.simulate.at_truth import vector_at_truth

#: Std of a doubt's prior that the tests let it lie off.
BOUND = 0.4


@pytest.fixture(scope="module")
def fit() -> tuple[Problem, Point]:
    """Two seconds of a session at a body 3 % too heavy, which no rig within these bounds makes up for."""
    session, truth = recorded(random_sample(3, 3), seed=4, duration=3.0)
    problem, _, _ = pose_problem(session)
    theta = vector_at_truth(problem.bench.parameters, truth)
    theta[INERTIAL:] = 0.0
    theta[:INERTIAL] = problem.bench.parameters.start(truth.elements * [1.03, *[1.0] * 9])[:INERTIAL]
    problem = replace(problem, runs=(problem.runs[0].until(2.0),), rests=(), bound=BOUND)
    return problem, Point(theta, (truth.starts["run_1"],), ())


def test_a_step_is_the_best_within_every_bound(fit: tuple[Problem, Point]) -> None:
    problem, point = fit
    problem = replace(problem, stride=np.inf)
    current = evaluate(problem, point)
    assert current is not None
    p = problem.bench.parameters.size
    step = _bounded_step(problem, current, 0.0)
    bounded = np.array([q.bounded for q in problem.bench.parameters.free])
    reached = (point.theta + step[:p])[INERTIAL:]
    assert np.all(np.abs(reached[bounded]) <= BOUND + 1e-9)
    at_bound = np.zeros(step.size, dtype=bool)
    at_bound[INERTIAL:p] = bounded & (np.abs(reached) > BOUND - 1e-9)
    assert np.count_nonzero(at_bound) >= 3
    # Karush, Kuhn and Tucker: nothing inside wants to move, what lies at a bound wants to go further out
    pull = current.gradient - current.information @ step
    scale = np.sqrt(np.diag(current.information))
    assert np.max(np.abs(pull / scale)[~at_bound]) < 1e-5
    assert np.all(np.sign(reached[at_bound[INERTIAL:p]]) * pull[at_bound] > 0.0)
    assert current.gradient @ step - 0.5 * step @ current.information @ step > 0.0


def test_residuals_without_derivatives_are_the_same(fit: tuple[Problem, Point]) -> None:
    problem, point = fit
    whole, quick = evaluate(problem, point), evaluate(problem, point, residuals_only=True)
    assert whole is not None
    assert quick is not None
    np.testing.assert_allclose(quick.runs[0].residual, whole.runs[0].residual, rtol=0.0, atol=1e-9)
    assert quick.cost == pytest.approx(whole.cost, rel=1e-12)


def test_a_start_that_is_no_number_cannot_be_evaluated(fit: tuple[Problem, Point]) -> None:
    problem, point = fit
    lost = replace(point.starts[0], velocity=np.full(3, np.nan))
    assert evaluate(problem, replace(point, starts=(lost,)), residuals_only=True) is None


def test_no_fit_ends_on_residuals_without_derivatives(
    fit: tuple[Problem, Point], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, point = fit
    first = evaluate(problem, point)
    assert first is not None
    tried = []

    def plateau(problem: Problem, at: Point, *, residuals_only: bool = False) -> Evaluation | None:
        """The first step fails; all others win what is rounding."""
        found = evaluate(problem, at, residuals_only=residuals_only)
        tried.append(residuals_only)
        worse = 1.0 if len(tried) == 2 else 1e-10 * abs(first.cost)
        return None if found is None else replace(found, cost=first.cost + worse)

    monkeypatch.setattr(fitting, "evaluate", plateau)
    found, _ = fitting.solve(problem, point, iterations=1)
    assert any(tried)
    p = problem.bench.parameters.size
    assert np.any(found.runs[0].jacobian[:, :p])


def test_a_step_is_pulled_back_into_the_valley(fit: tuple[Problem, Point]) -> None:
    """Where residuals are curved along a step, one that takes their second order back keeps its promise."""
    problem, point = fit
    problem = replace(problem, bound=np.inf, stride=np.inf)
    current = evaluate(problem, point)
    assert current is not None

    def at(change: np.ndarray) -> Evaluation:
        there = evaluate(problem, moved_by(problem, current, change), residuals_only=True)
        assert there is not None
        return there

    straight = _bounded_step(problem, current, 0.0)
    promised = fitting.promised_by(current, straight)
    back = at(_pulled_back(problem, current, 0.0, straight, at(straight)))
    assert abs(current.cost - back.cost - promised) < 0.1 * abs(current.cost - at(straight).cost - promised)
    # Where nothing is curved nothing is to be taken back
    tiny = _bounded_step(problem, current, 1e6)
    again = _pulled_back(problem, current, 1e6, tiny, at(tiny))
    scale = np.sqrt(np.diag(current.information))
    assert np.linalg.norm(scale * (again - tiny)) < 1e-3 * np.linalg.norm(scale * tiny)


def test_a_quadratic_in_a_box_is_minimised() -> None:
    rng = np.random.default_rng(5)
    for size in (1, 3, 12, 40):
        for _ in range(20):
            root = rng.normal(size=(size, size)) * np.exp(2.0 * rng.normal(size=size))
            matrix = root @ root.T + 1e-3 * np.eye(size)
            right = matrix @ rng.normal(scale=3.0, size=size)
            low, high = -rng.uniform(0.1, 2.0, size), rng.uniform(0.1, 2.0, size)
            x = in_box(matrix, right, low, high)
            assert np.all((x >= low) & (x <= high))
            known = lsq_linear(
                np.linalg.cholesky(matrix).T,
                np.linalg.solve(np.linalg.cholesky(matrix), right),
                (low, high),
                method="bvls",
            ).x

            def cost(x: np.ndarray, matrix: np.ndarray = matrix, right: np.ndarray = right) -> float:
                return float(0.5 * x @ matrix @ x - right @ x)

            assert cost(x) <= cost(known) + 1e-8 * abs(cost(known))
