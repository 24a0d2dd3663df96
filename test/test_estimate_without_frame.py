"""Taking the carrying frame off: exact on the values, linear on the uncertainty."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_model_rigs import elements_of, random_sample

from rig_identification.estimate.without_frame import (
    FRAME_CENTER_STD,
    FRAME_INERTIA_STD,
    FRAME_MASS_STD,
    subtract_frame,
)
from rig_identification.model.body import elements_from_linear, linear_from_elements, six_elements, tensor
from rig_identification.result import InertialEstimate
from rig_identification.rig import CarryingFrame

FRAME = CarryingFrame(
    168.0, np.array([1.9, 1.0, 0.9]), np.array([[90.0, 2.0, -4.0], [2.0, 210.0, 1.0], [-4.0, 1.0, 260.0]])
)


def together(body: np.ndarray, frame: CarryingFrame) -> np.ndarray:
    own = elements_of(frame.mass, frame.center_of_mass, frame.inertia)
    return elements_from_linear(linear_from_elements(body) + linear_from_elements(own))


@given(st.integers(0, 10_000))
@settings(max_examples=25, deadline=None)
def test_body_and_frame_less_frame_is_the_body(seed: int) -> None:
    body = random_sample(seed, 2).elements
    total = InertialEstimate(together(body, FRAME), np.zeros((10, 10)))
    np.testing.assert_allclose(subtract_frame(total, FRAME).values, body, rtol=1e-11, atol=1e-8)


def test_uncertainty_of_total_and_frame_adds_up() -> None:
    rng = np.random.default_rng(0)
    body = random_sample(4, 2).elements
    std = np.array([0.4, 4e-4, 3e-4, 6e-4, 0.9, 0.5, 0.7, 2.1, 0.6, 2.4])
    mixing = np.eye(10) + 0.3 * rng.standard_normal((10, 10))
    covariance = (mixing @ mixing.T) * np.outer(std, std)
    found = subtract_frame(InertialEstimate(together(body, FRAME), covariance), FRAME)
    draws = 20_000
    totals = rng.multivariate_normal(together(body, FRAME), covariance, draws)
    size = np.sqrt(np.outer(np.diag(FRAME.inertia), np.diag(FRAME.inertia)))
    frames = np.concatenate(
        [
            FRAME.mass * (1.0 + FRAME_MASS_STD * rng.standard_normal((draws, 1))),
            FRAME.center_of_mass + FRAME_CENTER_STD * rng.standard_normal((draws, 3)),
            six_elements(FRAME.inertia)
            + FRAME_INERTIA_STD * six_elements(size) * rng.standard_normal((draws, 6)),
        ],
        axis=1,
    )
    rest = np.array(
        [
            elements_from_linear(linear_from_elements(t) - linear_from_elements(f))
            for t, f in zip(totals, frames, strict=True)
        ]
    )
    ratio = np.std(rest, axis=0) / np.sqrt(np.diag(found.covariance))
    np.testing.assert_allclose(ratio, 1.0, atol=0.03)
    assert np.all(np.linalg.eigvalsh(tensor(found.values[4:])) > 0.0)


def test_what_the_total_does_not_tell_the_body_does_not_either() -> None:
    total = together(random_sample(4, 2).elements, FRAME)
    lost = subtract_frame(InertialEstimate(total, np.eye(10), ("Jzz",)), FRAME)
    assert lost.unobservable == ("Jzz",)
    height = subtract_frame(InertialEstimate(total, np.eye(10), ("cz",)), FRAME).unobservable
    assert set(height) == {"cz", "Jxx", "Jyy", "Jxz", "Jyz"}
    assert len(subtract_frame(InertialEstimate(total, np.eye(10), ("m",)), FRAME).unobservable) == 10


def test_a_frame_of_nearly_no_mass_changes_nothing() -> None:
    body = random_sample(9, 2).elements
    feather = CarryingFrame(1e-9, np.zeros(3), 1e-9 * np.eye(3))
    found = subtract_frame(InertialEstimate(body, np.eye(10)), feather)
    assert found.values == pytest.approx(body, rel=1e-9)
    np.testing.assert_allclose(found.covariance, np.eye(10), atol=1e-6)
