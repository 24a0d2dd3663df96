"""Charts of what hardly moves."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.report.line_chart import padded_limits, tick_label, ticks


@pytest.mark.parametrize("offset", [0.0, 1.0, -4000.0, 1e7])
@pytest.mark.parametrize("moves", [0.0, 1e-13, 1e-6, 1.0])
def test_what_hardly_moves_has_ticks_that_differ(offset: float, moves: float) -> None:
    """A tension of kilonewtons that moves by its last digit, for one."""
    low, high = padded_limits(offset + moves * np.array([0.0, 1.0, 0.5]))
    found = ticks(low, high, 4)
    assert low < offset < high or low < offset + moves < high
    assert len(found) >= 2
    assert np.all(np.diff(found) > 0.0)
    assert all(tick_label(v, found[1] - found[0]) for v in found)
