"""What promises about as much at another frequency gets a second start."""

from __future__ import annotations

import numpy as np
import pytest

from rig_identification.mismatch.rider_promises import ELSEWHERE, _peaks


@pytest.mark.parametrize(
    ("gains", "chosen"),
    [
        ([1.0, 9.0, 2.0, 3.0, 10.0, 4.0], [4, 1]),  # a peak that comes close
        ([1.0, 7.0, 2.0, 3.0, 10.0, 4.0], [4]),  # one that does not
        ([1.0, 2.0, 9.5, 10.0, 9.9, 1.0], [3]),  # a neighbour is no peak
        ([9.0, 1.0, 2.0, 10.0], [3, 0]),  # at the ends
        ([5.0], [0]),
        ([10.0, 9.6, 9.8, 9.0, 3.0, 8.5, 2.0], [0, 5]),  # beyond a valley, before a dent that comes closer
        ([10.0, 9.6, 9.8, 3.0, 1.0], [0, 2]),  # a dent where nothing else comes close
    ],
)
def test_the_best_peak_and_the_next(gains: list[float], chosen: list[int]) -> None:
    assert _peaks(np.array(gains)) == chosen
    assert 7.0 < ELSEWHERE * 10.0 < 9.0
