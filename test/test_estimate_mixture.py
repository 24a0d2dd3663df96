"""Bodies of several models that the recordings hardly tell apart, joined."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.estimate.mixture import DOUBT, mixture, weights
from rig_identification.result import InertialEstimate


def body(shift: float, std: float = 1.0) -> InertialEstimate:
    return InertialEstimate(np.full(10, shift), std**2 * np.eye(10))


def test_two_that_are_as_likely_meet_in_the_middle_and_cover_both() -> None:
    joined = mixture(body(0.0), [(0.0, body(6.0))])
    np.testing.assert_allclose(joined.values, 3.0)
    np.testing.assert_allclose(np.diag(joined.covariance), 1.0 + 9.0)


def test_what_is_refuted_changes_nothing_and_no_rival_leaves_the_answer_as_it_is() -> None:
    alone = body(1.0, 2.0)
    for joined in (mixture(alone, []), mixture(alone, [(60.0, body(30.0))])):
        np.testing.assert_allclose(joined.values, alone.values, atol=1e-6)
        np.testing.assert_allclose(joined.covariance, alone.covariance, atol=1e-6)


@pytest.mark.parametrize("gap", [0.5, 2.0, 4.0])
def test_odds_are_those_averaged_over_what_is_doubted_of_them(gap: float) -> None:
    """Against the average itself: of the logistic of a normal variable."""
    gaps = gap + DOUBT * np.random.default_rng(1).standard_normal(400_000)
    assert weights([gap])[1] == pytest.approx(float(np.mean(1.0 / (1.0 + np.exp(gaps)))), abs=0.02)


def test_a_rival_that_is_likelier_weighs_more_than_half() -> None:
    assert weights([-2.0])[1] > 0.5
    assert np.sum(weights([-2.0, 1.0, 5.0])) == pytest.approx(1.0)
