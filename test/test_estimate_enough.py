"""Long runs: as much of them as a fit needs, and that is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_samples import make_recording, make_rig

from rig_identification.estimate.enough import enough, liveliest, told
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


def test_what_is_cut_from_a_cut_run_says_where_it_lies_in_the_recording() -> None:
    (cut,) = enough((swinging(20.0, (12.0, 16.0)),), most=4.0)
    assert f"used from {cut.offset:.1f} to" in told((cut,))[0]
    assert cut.recording.duration >= 20.0
