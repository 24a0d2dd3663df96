"""Forms of the ten inertial parameters: round trips, and that any ten numbers give a body that can exist."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from test_model_rigs import random_sample

from rig_identification.model.body import (
    can_exist,
    complex_step_jacobian,
    elements_from_linear,
    linear_from_elements,
    linear_from_log_cholesky,
    log_cholesky_from_linear,
    point_inertia,
    six_elements,
    tensor,
)

ANY_TEN = arrays(float, 10, elements=st.floats(-1.5, 1.5))


@given(ANY_TEN)
def test_any_ten_numbers_are_a_body(theta: np.ndarray) -> None:
    linear = linear_from_log_cholesky(theta)
    assert can_exist(elements_from_linear(linear))
    # Positive for every direction, the triangle inequality included: the pseudo-inertia is positive definite
    about_datum = tensor(linear[4:])
    pseudo = np.empty((4, 4))
    pseudo[:3, :3] = 0.5 * np.trace(about_datum) * np.eye(3) - about_datum
    pseudo[:3, 3] = pseudo[3, :3] = linear[1:4]
    pseudo[3, 3] = linear[0]
    assert np.linalg.eigvalsh(pseudo)[0] > 0.0


@given(ANY_TEN)
def test_log_cholesky_round_trip(theta: np.ndarray) -> None:
    again = log_cholesky_from_linear(linear_from_log_cholesky(theta))
    np.testing.assert_allclose(again, theta, atol=1e-8)


@given(st.integers(0, 10_000))
@settings(max_examples=30)
def test_elements_round_trip(seed: int) -> None:
    elements = random_sample(seed, 2).elements
    linear = linear_from_elements(elements)
    np.testing.assert_allclose(elements_from_linear(linear), elements, rtol=1e-12, atol=1e-9)
    theta = log_cholesky_from_linear(linear)
    np.testing.assert_allclose(linear_from_log_cholesky(theta), linear, rtol=1e-10, atol=1e-8)


def test_points_of_mass_add_up_to_the_linear_form() -> None:
    """The form in which Newton and Euler are linear is a sum over points, and so is this cloud."""
    rng = np.random.default_rng(1)
    masses, points = rng.uniform(1.0, 9.0, 20), rng.normal(size=(20, 3))
    total = sum(
        np.concatenate([[m], m * p, six_elements(point_inertia(m, p))])
        for m, p in zip(masses, points, strict=True)
    )
    elements = elements_from_linear(np.asarray(total))
    center = masses @ points / masses.sum()
    about = sum(point_inertia(m, p - center) for m, p in zip(masses, points, strict=True))
    assert elements[0] == pytest.approx(masses.sum())
    np.testing.assert_allclose(elements[1:4], center)
    np.testing.assert_allclose(tensor(elements[4:]), about)
    x, y = points[:, 0] - center[0], points[:, 1] - center[1]
    assert elements[5] == pytest.approx(-float(np.sum(masses * x * y)))


@given(ANY_TEN)
@settings(max_examples=20)
def test_complex_step_against_central_differences(theta: np.ndarray) -> None:
    exact = complex_step_jacobian(linear_from_log_cholesky, theta)
    h = 1e-4
    for i in range(10):
        step = h * np.eye(10)[i]
        coarse = (linear_from_log_cholesky(theta + step) - linear_from_log_cholesky(theta - step)) / (2 * h)
        fine = (linear_from_log_cholesky(theta + step / 2) - linear_from_log_cholesky(theta - step / 2)) / h
        numeric = (4.0 * fine - coarse) / 3.0
        np.testing.assert_allclose(exact[:, i], numeric, atol=1e-8 * max(1.0, np.max(np.abs(exact))))


@pytest.mark.parametrize(
    "elements",
    [
        [-1.0, 0, 0, 0, 1, 0, 0, 1, 0, 1],
        [1.0, 0, 0, 0, 1, 0, 0, 1, 0, 2.5],  # more than a flat plate can have
        [1.0, 0, 0, 0, 1, 1.5, 0, 1, 0, 1],  # not positive
        [1.0, 0, 0, np.nan, 1, 0, 0, 1, 0, 1],
    ],
)
def test_bodies_that_cannot_exist(elements: list[float]) -> None:
    assert not can_exist(np.array(elements, dtype=float))


def test_log_cholesky_refuses_what_cannot_exist() -> None:
    plate_and_more = linear_from_elements(np.array([1.0, 0, 0, 0, 1, 0, 0, 1, 0, 2.5]))
    with pytest.raises(np.linalg.LinAlgError):
        log_cholesky_from_linear(plate_and_more)
