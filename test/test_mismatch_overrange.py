"""A sensor that stops at the end of its range is said, and its samples are left out."""

from __future__ import annotations

from dataclasses import replace

import pytest
from test_session_quality import make_recording

from rig_identification.mismatch.overrange import with_overranges
from rig_identification.recording import ChannelQuality, Overrange, Session
from rig_identification.result import Mismatch

QUALITY = ChannelQuality("/rig/imu/data_raw", 900, 800, 500.0, 0.0, 2.0, 0, 0, 0.0, 0, 0, 0, 100)
LOW = Overrange("imu", "angular_rate", "x", "rad/s", -0.02, 60, 0.5, 1.5)
HIGH = Overrange("imu", "angular_rate", "x", "rad/s", 0.02, 40, 0.2, 1.0)


def session(*ends: Overrange) -> Session:
    recording = replace(make_recording(seconds=1.0, seed=1), quality=(replace(QUALITY, overranges=ends),))
    return Session("s", None, (recording,))  # type: ignore[arg-type]


@pytest.mark.parametrize(("verdict", "after"), [("none", "explained"), ("unexplained", "unexplained")])
def test_both_ends_of_one_axis_are_one_finding(verdict: str, after: str) -> None:
    told = with_overranges(Mismatch(verdict, "Every residual is noise."), session(LOW, HIGH))
    (finding,) = told.findings
    assert told.verdict == after
    assert finding.effect == "unknown"
    assert (finding.where["channel"], finding.where["axis"]) == ("imu", "x")
    assert [(t["start"], t["end"]) for t in finding.where["times"]] == [(0.2, 1.5)]  # type: ignore[attr-defined,index]
    assert finding.parameters["limit"] == {"value": 0.02, "std": 0.0, "unit": "rad/s"}
    assert "100 samples" in finding.statement
    assert "-0.02 and 0.02" in finding.statement


def test_a_session_within_range_stays_as_it_is() -> None:
    mismatch = Mismatch("none", "Every residual is noise.")
    assert with_overranges(mismatch, session()) is mismatch
