"""A gyroscope turned about the vertical against its description: told by how a body on two threads rolls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.mismatch.gyroscope_heading import (
    Turned,
    gyroscope_heading,
    heading_told,
    with_heading,
)
from rig_identification.recording import Recording, Series, Session
from rig_identification.result import Mismatch
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Mount, Rig

TIME = np.arange(0.0, 30.0, 0.02)


def session(turn: float, *, described: float = 0.0, rolls: float = 0.01, threads: int = 2) -> Session:
    """A body that turns and rolls about the line of its hinges (x); its gyroscope is turned by ``turn``."""
    angles = 2.0 * np.pi * np.arange(threads) / threads
    points = 0.2 * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    cables = tuple(Cable(f"cable_{i}", p, p, 1.8) for i, p in enumerate(points))
    tolerance = {**DEFAULT_TOLERANCE, "imu_orientation": 0.05}
    as_described = Mount(np.zeros(3), Rotation.from_rotvec([0.0, 0.0, described]).as_quat())
    rig = Rig(9.80665, cables, 0.5, 0.01, imu=as_described, tolerance=tolerance)
    runs = []
    for seed, holdout in ((1, False), (2, True)):
        rng = np.random.default_rng(seed)
        body = np.zeros((TIME.size, 3))
        body[:, 2] = 0.5 * np.cos(2.0 * np.pi * 0.52 * TIME)
        body[:, 0] = rolls * np.cos(2.0 * np.pi * 1.3 * TIME + seed) + 0.01 * body[:, 2]
        read = Rotation.from_rotvec([0.0, 0.0, turn]).inv().apply(body) + 5e-4 * rng.normal(size=body.shape)
        values = np.full((TIME.size, 6), np.nan)
        values[:, :3] = read
        runs.append(Recording(f"run_{seed}", "dynamic", holdout, 0, 30.0, imu=Series(TIME, values)))
    return Session("drone", rig, tuple(runs))


@pytest.mark.parametrize("turn", [0.8, -0.3, 1.5])
def test_the_mount_is_turned_as_it_is(turn: float) -> None:
    one = session(turn)
    found = gyroscope_heading(one)
    assert found is not None
    assert found.angle == pytest.approx(turn, abs=3.0 * found.std)
    assert found.std < 0.1
    mended = with_heading(one, found)
    assert mended.rig.imu is not None
    about = Rotation.from_quat(mended.rig.imu.orientation).as_rotvec()
    assert about == pytest.approx([0.0, 0.0, turn], abs=3.0 * found.std)
    assert gyroscope_heading(mended) is None


def test_from_a_mount_that_is_described_turned() -> None:
    found = gyroscope_heading(session(0.9, described=0.5))
    assert found is not None
    assert found.angle == pytest.approx(0.4, abs=3.0 * found.std)


def test_an_ordinary_mount_noise_and_three_threads_tell_nothing() -> None:
    assert gyroscope_heading(session(0.1)) is None
    assert gyroscope_heading(session(0.8, rolls=0.0)) is None
    assert gyroscope_heading(session(0.8, threads=3)) is None


def test_where_a_tracker_tells_the_mount_nothing_is_turned() -> None:
    one = session(0.8)
    seen = Series(TIME, np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (TIME.size, 1)))
    runs = tuple(replace(run, mocap=seen) for run in one.recordings)
    assert gyroscope_heading(replace(one, recordings=runs)) is None


def test_what_was_turned_is_told() -> None:
    plain = Mismatch("none", "Every residual is noise.")
    assert heading_told(plain, None) is plain
    told = heading_told(plain, Turned(0.8, 0.01))
    assert told.verdict == "explained"
    (finding,) = told.findings
    assert finding.effect == "imu_misalignment"
    assert finding.parameters["angle"]["value"] == 0.8
