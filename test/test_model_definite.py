"""Matrices that are positive definite but for rounding."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig_identification.model.definite import definite


def _information(seed: int, size: int, decades: float) -> np.ndarray:
    """J^T J of columns whose directions are known to so many more decades than others."""
    rng = np.random.default_rng(seed)
    basis = np.linalg.qr(rng.normal(size=(size, size)))[0]
    roots = 10.0 ** (-rng.uniform(0.0, decades, size))
    J = rng.normal(size=(3 * size, size)) @ (basis * roots) @ basis.T
    return np.asarray(J.T @ J)


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 10_000), size=st.integers(2, 30), decades=st.floats(0.0, 14.0))
def test_it_has_a_factor_and_differs_by_no_more_than_rounding(seed: int, size: int, decades: float) -> None:
    matrix = _information(seed, size, decades)
    found = definite(matrix)
    np.linalg.cholesky(found)
    scale = np.sqrt(np.diag(matrix))
    assert np.max(np.abs(found - matrix) / np.outer(scale, scale)) < 1e3 * size * np.finfo(float).eps


def test_one_that_has_a_factor_stays_bit_for_bit() -> None:
    matrix = _information(1, 8, 2.0)
    assert definite(matrix) is matrix


@pytest.mark.parametrize(
    "matrix", [np.zeros((3, 3)), np.diag([1.0, 0.0, 4.0]), np.diag([1e30, 1e-30, -1e-20])]
)
def test_directions_of_which_nothing_is_known_are_no_obstacle(matrix: np.ndarray) -> None:
    assert np.all(np.isfinite(np.linalg.solve(definite(matrix), np.ones(3))))


def test_what_is_no_number_cannot_be_mended() -> None:
    with pytest.raises(np.linalg.LinAlgError, match="no number"):
        definite(np.diag([1.0, np.nan]))
