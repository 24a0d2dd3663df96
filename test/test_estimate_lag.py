"""A lagging device against the closed solution of its equation."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.estimate.evidence import NODE_STEP, WIDE_NODE_STEP
from rig_identification.estimate.lag import lagged, settling_cost


@pytest.mark.parametrize("step", [NODE_STEP, WIDE_NODE_STEP])
@pytest.mark.parametrize("tau", [1e-4, 0.004, 0.02, 0.3])
def test_a_sine_comes_late_and_small(tau: float, step: float) -> None:
    """A lag of 4 ms makes a sine of 1.3 Hz 5e-4 smaller: what a fit tells it from a late clock by."""
    omega = 2.0 * np.pi * 1.3
    t = step * np.arange(1200)
    shown = lagged(step, tau, np.sin(omega * t)[:, None])[:, 0]
    expected = np.sin(omega * t - np.arctan(omega * tau)) / np.hypot(1.0, omega * tau)
    off = np.abs(shown - expected)[t > 18.0 * tau]
    assert np.max(off[:-2]) < 3e-6
    # The last node's bend is its neighbour's
    assert np.max(off) < 3e-5


def test_a_ramp_is_late_by_the_time_constant_from_the_first_node_on() -> None:
    t = 0.01 * np.arange(50)
    for tau in (-0.02, 0.0, 0.003, 0.05):
        np.testing.assert_allclose(lagged(0.01, tau, t[:, None])[:, 0], t - tau, atol=1e-12)


def test_what_a_device_showed_before_a_run_costs_one_unknown_and_not_every_sample() -> None:
    """The marginal likelihood of noise with one unknown e exp(-t/tau) beside it, in closed form.

    The device happened to be at its steady answer; that it had to be is not known.
    """
    rng = np.random.default_rng(3)
    t, tau, noise, before = 0.005 * np.arange(400), 0.03, 1.0, 300.0
    shape = np.exp(-t / tau)
    drawn = rng.normal(0.0, noise, (200, t.size))
    covariance = noise**2 * np.eye(t.size) + before**2 * np.outer(shape, shape)
    exact = 0.5 * np.einsum("ij,ij->i", drawn, np.linalg.solve(covariance, drawn.T).T)
    exact = np.mean(exact) + 0.5 * np.linalg.slogdet(covariance)[1]
    extra = ((before * shape) ** 2)[:, None]
    variance = np.full((t.size, 1), noise**2)
    told = 0.5 * np.mean(np.sum(drawn**2 / (variance + extra)[:, 0], axis=1))
    told += 0.5 * np.sum(np.log(variance + extra))
    assert told - exact > 40.0
    assert told + settling_cost(variance, extra) == pytest.approx(exact, abs=2.0)
    assert settling_cost(variance, np.zeros_like(extra)) == 0.0
