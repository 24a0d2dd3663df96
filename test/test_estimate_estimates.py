"""What follows from several fitted parameters has the std that their joint errors give it."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.estimate.estimates import Estimates

NAMES = ("compliance", "frequency", "other")


def test_a_quotient_spreads_as_draws_of_its_parts_do() -> None:
    covariance = np.array([[4e-4, 3e-4, 0.0], [3e-4, 9e-4, 1e-4], [0.0, 1e-4, 1e-2]])
    found = Estimates(dict(zip(NAMES, (1.0, 2.0, -3.0), strict=True)), covariance)
    value, std = found.following(lambda c, f: c / f**2, "compliance", "frequency")
    c, f, _ = np.random.default_rng(1).multivariate_normal([1.0, 2.0, -3.0], covariance, 400_000).T
    assert value == 0.25
    assert std == pytest.approx(np.std(c / f**2), rel=0.01)


def test_a_ceiling_s_mass_is_as_open_as_the_line_that_its_ring_holds() -> None:
    """k/(M + m) is known and nothing else: dM is dk (M + m)/k, more than the two errors by themselves."""
    k, M, m = 33e6, 1490.0, 1835.0
    c, f = 1.0 / k, np.sqrt(k / M) / (2.0 * np.pi)
    relative = 0.03  # of the stiffness
    # c = 1/k; f^2 = k/M/(2 pi)^2 with dM/M = dk/k (M + m)/M
    along = np.array([-c * relative, 0.5 * f * relative * (1.0 - (M + m) / M)])
    found = Estimates({"compliance": c, "frequency": f}, np.outer(along, along))
    mass, std = found.following(lambda c, f: 1.0 / (c * (2.0 * np.pi * f) ** 2), *NAMES[:2])
    assert mass == pytest.approx(M)
    assert std == pytest.approx(relative * (M + m), rel=1e-4)
    alone = M * np.hypot(relative, 2.0 * abs(along[1]) / f)
    assert std > 1.3 * alone


def test_what_is_known_exactly_stays_known() -> None:
    found = Estimates({"a": 2.0, "b": 3.0}, np.diag([0.0, 0.01]))
    assert found.following(lambda a: 1.0 / a, "a") == (0.5, 0.0)
    assert found.following(lambda a, b: a * b, "a", "b") == (6.0, pytest.approx(0.2))


def test_ordinary_errors_come_on_top_of_wider_ones() -> None:
    found = Estimates({"a": 2.0, "b": 3.0}, np.array([[0.04, 0.01], [0.01, 0.09]]))
    wider = found.doubted(4.0, {"b": 0.8, "elsewhere": 9.0})
    assert wider.of("a") == (2.0, pytest.approx(0.4))
    assert wider.of("b") == (3.0, pytest.approx(1.0))
    assert wider.covariance[0, 1] == pytest.approx(0.04)
