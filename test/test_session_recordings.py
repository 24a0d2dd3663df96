"""Recordings of real rigs and of another simulator, where this machine has them."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from rig_identification.session import read_session, write_session

FOLDER = Path(
    os.environ.get(
        "RIG_IDENTIFICATION_RECORDINGS", Path(__file__).resolve().parents[2] / "shared" / "recordings"
    )
)
SESSIONS = sorted(file.parent for file in FOLDER.glob("*/session.yaml"))
#: Sessions of the simulator whose bags hold the ground truth; the contract leaves it to the recording.
WITH_TRUTH = {"session_a", "session_b", "session_c"}
pytestmark = pytest.mark.skipif(
    not SESSIONS, reason=f"no sessions in {FOLDER}: set RIG_IDENTIFICATION_RECORDINGS to a folder of sessions"
)


@pytest.mark.parametrize("folder", SESSIONS, ids=lambda folder: folder.name)
def test_every_session_is_read_whole(folder: Path) -> None:
    session = read_session(folder)
    assert session.name == folder.name
    for recording in session.recordings:
        assert recording.duration > 5.0
        for item in recording.quality:
            assert item.used == item.count
            assert item.missing <= 1
        for cable, series in recording.tension.items():
            assert np.all(series.values > 0.0), cable
        if recording.mocap is not None:
            norms = np.linalg.norm(recording.mocap.values[:, 3:], axis=1)
            np.testing.assert_allclose(norms, 1.0, atol=1e-12)


@pytest.mark.parametrize("folder", SESSIONS, ids=lambda folder: folder.name)
def test_statics_and_truth_agree_with_the_description(folder: Path) -> None:
    session = read_session(folder)
    if folder.name in WITH_TRUTH:
        assert all(recording.ground_truth is not None for recording in session.recordings)
    for recording in session.statics:
        assert recording.imu is not None
        force = float(np.linalg.norm(recording.imu.values[:, 3:].mean(axis=0)))
        assert force == pytest.approx(session.rig.gravity, abs=0.1)
        if recording.ground_truth is not None:
            assert np.abs(recording.ground_truth.values[:, 7:]).max() < 1e-3
    for recording in session.training:
        if recording.ground_truth is not None:
            time, values = recording.ground_truth.time, recording.ground_truth.values
            speed = np.linalg.norm(np.gradient(values[:, :3], time, axis=0), axis=1)
            twist = np.linalg.norm(values[:, 7:10], axis=1)
            np.testing.assert_allclose(speed[1:-1], twist[1:-1], atol=5e-3)


def test_a_session_goes_through_the_writer_unchanged(tmp_path: Path) -> None:
    session = read_session(SESSIONS[-1])
    again = read_session(write_session(session, tmp_path / "again", storage="sqlite3"))
    assert repr(again.rig) == repr(session.rig)
    for one, other in zip(again.recordings, session.recordings, strict=True):
        for cable in other.tension:
            np.testing.assert_array_equal(one.tension[cable].values, other.tension[cable].values)
            np.testing.assert_array_equal(one.tension[cable].time, other.tension[cable].time)
