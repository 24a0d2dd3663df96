"""Held-out runs that ask for other parameters: chance, and what is not chance, against linear theory."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import kstest, multivariate_normal

from rig_identification.estimate.constancy import departure, log_predictive
from rig_identification.model.definite import integrated_out

PARAMETERS, STARTS, ROWS = 6, 4, 120


def linear_world(rng: np.random.Generator, moved: np.ndarray) -> tuple[np.ndarray, SimpleNamespace]:
    """A fitted linear model's information, and a held-out run of parameters ``moved`` from its truth."""
    truth = rng.normal(size=PARAMETERS)  # prior N(0, 1)
    rows = rng.normal(size=(ROWS, PARAMETERS)) * np.logspace(-2.5, 0.5, PARAMETERS)
    begun = rng.normal(size=(ROWS, STARTS))
    both = np.concatenate([rows, begun], axis=1)
    data = rows @ truth + begun @ rng.normal(size=STARTS) + rng.normal(size=ROWS)
    information = both.T @ both
    information[:PARAMETERS, :PARAMETERS] += np.eye(PARAMETERS)
    fitted = np.linalg.solve(information, both.T @ data)[:PARAMETERS]
    other = rng.normal(size=(ROWS, PARAMETERS)) * np.logspace(-2.5, 0.5, PARAMETERS)
    starts = rng.normal(size=(ROWS, STARTS))
    measured = other @ (truth + moved) + starts @ rng.normal(size=STARTS) + rng.normal(size=ROWS)
    run = SimpleNamespace(
        jacobian=np.concatenate([other, starts], axis=1), residual=measured - other @ fitted
    )
    return integrated_out(information, PARAMETERS), run


def test_where_the_model_holds_its_chance_is_even() -> None:
    rng = np.random.default_rng(7)
    chances = []
    for _ in range(400):
        shared, run = linear_world(rng, np.zeros(PARAMETERS))
        found = departure("run_2", shared, run)
        assert 0 < found.directions < PARAMETERS, "what the prior alone knows is no comparison"
        chances.append(10.0**found.log10_p)
    assert kstest(chances, "uniform").pvalue > 0.01


@pytest.mark.parametrize("direction", [PARAMETERS - 1, PARAMETERS - 2])
def test_parameters_that_moved_are_told(direction: int) -> None:
    rng = np.random.default_rng(8)
    moved = np.zeros(PARAMETERS)
    moved[direction] = 3.0
    shared, run = linear_world(rng, moved)
    found = departure("run_2", shared, run)
    assert found.log10_p < -5.0
    assert found.excess > 3.0


def test_directions_that_the_held_out_run_does_not_see_tell_nothing() -> None:
    rng = np.random.default_rng(9)
    moved = np.zeros(PARAMETERS)
    moved[0] = 30.0  # hardly shows in any row
    shared, run = linear_world(rng, moved)
    assert departure("run_2", shared, run).log10_p > -3.0


def test_a_held_out_run_is_as_likely_as_what_the_fit_leaves_open_makes_it() -> None:
    """Against the normal density of its readings, of which start states take their directions away."""
    rng = np.random.default_rng(10)
    both = []
    for _ in range(2):
        shared, run = linear_world(rng, np.zeros(PARAMETERS))
        run.cost = 0.5 * float(run.residual @ run.residual)
        columns, starts = run.jacobian[:, :PARAMETERS], run.jacobian[:, PARAMETERS:]
        unseen = np.linalg.svd(starts)[0][:, STARTS:].T
        spread = columns @ np.linalg.solve(shared, columns.T) + np.eye(ROWS)
        density = multivariate_normal(cov=unseen @ spread @ unseen.T)
        both.append((log_predictive(shared, run), density.logpdf(unseen @ run.residual)))
    (told, exact), (other, exact_other) = both
    assert told - other == pytest.approx(exact - exact_other, rel=1e-6)


def test_a_start_that_leaves_no_trace_takes_nothing_away() -> None:
    """Dry hinges stop a body wherever it starts: the equations of its start are singular."""
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(40, PARAMETERS + 2))
    information = columns.T @ columns
    traceless = np.zeros((PARAMETERS + 3, PARAMETERS + 3))
    traceless[: PARAMETERS + 2, : PARAMETERS + 2] = information
    np.testing.assert_allclose(
        integrated_out(traceless, PARAMETERS), integrated_out(information, PARAMETERS), rtol=1e-9
    )
