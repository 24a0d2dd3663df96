"""Long runs: as much of them as a fit needs, and that is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_samples import make_recording, make_rig

from rig_identification.estimate.enough import enough, liveliest, share_of_std, told
from rig_identification.estimate.evidence import Run, prepare


def swinging(seconds: float, lively: tuple[float, float]) -> Run:
    """A run whose tensions swing from ``lively[0]`` to ``lively[1]`` s and are noise elsewhere."""
    recording = make_recording("dynamic", seconds=seconds, amplitude=0.0)
    tension = {}
    for cable, series in recording.tension.items():
        inside = (series.time >= lively[0]) & (series.time <= lively[1])
        swing = 400.0 * np.sin(2.0 * np.pi * series.time) * inside
        tension[cable] = replace(series, values=series.values + swing[:, None])
    return prepare(make_rig(), replace(recording, tension=tension), step=0.01)


def test_short_runs_stay_whole() -> None:
    runs = (swinging(10.0, (0.0, 10.0)), swinging(5.0, (0.0, 5.0)))
    assert enough(runs) == runs
    assert told(runs) == ()


def test_long_ones_share_the_time_by_their_length() -> None:
    runs = (swinging(20.0, (0.0, 20.0)), swinging(10.0, (0.0, 10.0)))
    cut = enough(runs, most=9.0)
    assert [run.grid.duration for run in cut] == pytest.approx([6.0, 3.0], abs=0.02)
    assert len(told(cut)) == 2
    assert "20 s" in told(cut)[0]


def test_the_stretch_that_moves_most_is_used() -> None:
    part = liveliest(swinging(20.0, (12.0, 16.0)), 4.0)
    assert 11.8 < part.offset < 12.2


def test_how_much_of_the_motion_a_stretch_holds_is_known() -> None:
    """Noise moves nothing: of a swing that stands still outside of a stretch all is in it."""
    assert liveliest(swinging(20.0, (12.0, 16.0)), 5.0).lively == pytest.approx(1.0, abs=0.02)
    assert liveliest(swinging(20.0, (0.0, 20.0)), 5.0).lively == pytest.approx(0.25, abs=0.02)


def test_more_seconds_narrow_what_noise_decides_and_not_what_is_believed() -> None:
    """Four times as much halves the first number's std; what belief tells stays; a sum lies between."""
    believed, told_by_runs = np.diag([1e-9, 4.0]), np.diag([1.0, 1e-9])
    elements = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    share = share_of_std(believed, told_by_runs, 4.0, elements)
    assert share == pytest.approx([0.5, 1.0, np.sqrt((0.25 + 0.25) / (1.0 + 0.25))], rel=1e-6)


def test_what_is_cut_from_a_cut_run_says_where_it_lies_in_the_recording() -> None:
    (cut,) = enough((swinging(20.0, (12.0, 16.0)),), most=4.0)
    assert f"used from {cut.offset:.1f} to" in told((cut,))[0]
    assert cut.recording.duration >= 20.0
