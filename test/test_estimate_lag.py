"""A lagging device against the closed solution of its equation."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.estimate.evidence import NODE_STEP, WIDE_NODE_STEP
from rig_identification.estimate.lag import lagged


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
