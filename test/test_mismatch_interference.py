"""A tone in what one kind of device reads at rest is taken out and told; what moves the body is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.mismatch.interference import lines_at_rest, without_lines
from rig_identification.recording import Recording, Series, Session
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

TONE, HUM = 37.013, {"cable_1": 4.0, "cable_2": 9.0, "cable_3": 2.0, "cable_4": 6.0}


def _tone(time: np.ndarray, phase: float) -> np.ndarray:
    return np.asarray(np.sin(2.0 * np.pi * TONE * time + phase)[:, None])


def _humming(recording: Recording, sizes: dict[str, float], begun: float = 0.0) -> Recording:
    """begun: phase of the recording, in which the mains are wherever they are."""
    tension = {
        name: replace(series, values=series.values + sizes.get(name, 0.0) * _tone(series.time, begun + i))
        for i, (name, series) in enumerate(recording.tension.items())
    }
    return replace(recording, tension=tension)


def _all(session: Session, sizes: dict[str, float]) -> Session:
    recordings = tuple(_humming(r, sizes, 2.0 * i) for i, r in enumerate(session.recordings))
    return replace(session, recordings=recordings)


@pytest.fixture(scope="module")
def quiet() -> Session:
    made, _ = simulate_session(replace(shaken(10, 10.0), doubts=False), np.random.default_rng(2))
    return made


def test_nothing_is_heard_in_white_noise(quiet: Session) -> None:
    assert lines_at_rest(quiet) == []


def test_a_tone_is_measured_and_taken_out(quiet: Session) -> None:
    loud = _all(quiet, HUM)
    (line,) = lines_at_rest(loud)
    assert line.kind == "tension"
    assert abs(line.frequency - TONE) < 2e-3
    for (cable, _), amplitude in line.amplitudes.items():
        assert abs(amplitude - HUM[cable]) < 4.0 * line.std
    for recording, before in zip(without_lines(loud, [line]).recordings, quiet.recordings, strict=True):
        for name, series in recording.tension.items():
            left = series.values - before.tension[name].values
            assert np.std(left) < 0.05 * HUM[name] + 3.0 * line.std


def test_what_dies_away_is_no_interference(quiet: Session) -> None:
    def ringing(recording: Recording) -> Recording:
        series = recording.tension["cable_1"]
        fading = 9.0 * np.exp(-series.time[:, None] / 0.7) * _tone(series.time, 0.0)
        tension = {**recording.tension, "cable_1": replace(series, values=series.values + fading)}
        return replace(recording, tension=tension)

    assert lines_at_rest(replace(quiet, recordings=tuple(map(ringing, quiet.recordings)))) == []


def test_what_the_imu_feels_as_well_is_no_interference(quiet: Session) -> None:
    def shaking(recording: Recording) -> Recording:
        imu = recording.imu
        assert imu is not None
        values = imu.values.copy()
        values[:, 5] += 0.3 * _tone(imu.time, 1.0)[:, 0]
        return replace(recording, imu=Series(imu.time, values))

    loud = _all(quiet, HUM)
    assert lines_at_rest(replace(loud, recordings=tuple(map(shaking, loud.recordings)))) == []


def test_it_is_told_beside_an_answer_that_it_does_not_touch(quiet: Session) -> None:
    plain, loud = identify(quiet), identify(_all(quiet, HUM))
    (finding,) = loud.mismatch.findings
    assert (plain.mismatch.verdict, loud.mismatch.verdict) == ("none", "explained")
    assert (finding.effect, finding.where["channel"]) == ("unknown", "cable_2")
    assert finding.where["law"] == "interference"
    std = np.sqrt(np.diag(plain.total.covariance))
    assert np.max(np.abs(loud.total.values - plain.total.values) / std) < 0.5
