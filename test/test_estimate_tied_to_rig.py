"""On which number of the description the inertia about the vertical rests, in words."""

from __future__ import annotations

import numpy as np

from rig_identification.estimate.tied_to_rig import tied_note
from rig_identification.result import ELEMENTS, InertialEstimate, UncertaintySource

ZZ = ELEMENTS.index("Jzz")


def estimate(**variances: float) -> InertialEstimate:
    """Jzz of 0.0067 with a variance from each source, and a certain rest."""
    sources = []
    for name, variance in variances.items():
        covariance = np.zeros((10, 10))
        covariance[ZZ, ZZ] = variance
        sources.append(UncertaintySource(name.replace("__", "."), "tolerance", covariance))
    values = np.ones(10)
    values[ZZ] = 0.0067
    whole = np.asarray(sum(s.covariance for s in sources))
    return InertialEstimate(values, whole, (), tuple(sources))


def test_a_distance_known_to_a_decimetre_is_most_of_the_doubt() -> None:
    note = tied_note(estimate(tolerance__hinge_position=(0.4 * 0.0067) ** 2, noise=(0.01 * 0.0067) ** 2))
    assert note is not None
    assert "where the hinges are" in note
    assert "78 %" in note
    assert "known inertia" in note


def test_where_no_tolerance_is_most_of_it_nothing_is_told() -> None:
    assert tied_note(estimate(tolerance__hinge_position=1e-8, noise=2e-8)) is None
    unknown = estimate(tolerance__hinge_position=1e-8)
    assert tied_note(InertialEstimate(unknown.values, unknown.covariance, ("Jzz",), unknown.sources)) is None
    assert tied_note(InertialEstimate(unknown.values, unknown.covariance)) is None
