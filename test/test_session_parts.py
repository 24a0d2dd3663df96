"""A recording says what of a thing it measured: NaN, a covariance, a point, an angle, a filled column."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from session_samples import START_NS, make_recording, rewrite, write_single

from rig_identification.cleaning.rest import first_motion
from rig_identification.errors import InputError
from rig_identification.recording import Recording, Series
from rig_identification.session import read_session
from rig_identification.session.messages import TYPESTORE
from rig_identification.statics import observe_static

IMU, POSE = "/rig/imu/data_raw", "/rig/mocap/pose"
RATE = 30.0


def read_one(folder: Path) -> Recording:
    return read_session(folder).recordings[0]


def test_what_is_measured_together_makes_a_part() -> None:
    values = np.arange(12.0).reshape(4, 3)
    values[1, 0] = values[2, 0] = values[3, :] = np.nan
    parts = Series(np.arange(4.0), values).parts()
    assert [part.components for part in parts] == [(1, 2), (0, 1, 2)]
    np.testing.assert_array_equal(parts[0].series.time, [1.0, 2.0])
    np.testing.assert_array_equal(parts[0].series.values, [[4.0, 5.0], [7.0, 8.0]])
    # Columns keep their place in the series
    assert Series(np.arange(4.0), values).parts(slice(2, 3))[0].components == (2,)


def test_an_imu_without_accelerometer_says_so_by_its_covariance(tmp_path: Path) -> None:
    recording = make_recording()
    folder = write_single(recording, tmp_path / "session")

    def edit(topic: str, index: int, message: Any) -> Any:
        if topic == IMU:
            unknown = np.array([-1.0, *8 * [0.0]])
            return replace(message, linear_acceleration_covariance=unknown)
        return message

    rewrite(folder / recording.name, edit)
    imu, before = read_one(folder).imu, recording.imu
    assert imu is not None
    assert before is not None
    assert np.isnan(imu.values[:, 3:]).all()
    np.testing.assert_allclose(imu.values[:, :3], before.values[:, :3])


def test_a_component_that_is_missing_now_and_then_leaves_the_others(tmp_path: Path) -> None:
    recording = make_recording()
    assert recording.imu is not None
    values = recording.imu.values.copy()
    values[::7, 4] = np.nan
    folder = write_single(replace(recording, imu=Series(recording.imu.time, values)), tmp_path / "session")
    imu = read_one(folder).imu
    assert imu is not None
    np.testing.assert_allclose(imu.values, values)


def test_a_filled_column_of_a_run_counts_as_not_measured(tmp_path: Path) -> None:
    recording = make_recording()
    assert recording.imu is not None
    values = recording.imu.values.copy()
    values[:, 3:] = [0.0, 0.0, 9.80665]
    read = read_one(
        write_single(replace(recording, imu=Series(recording.imu.time, values)), tmp_path / "session")
    )
    assert read.imu is not None
    assert np.isnan(read.imu.values[:, 3:]).all()
    assert np.isfinite(read.imu.values[:, :3]).all()
    notes = next(q.notes for q in read.quality if q.topic == IMU)
    assert any("specific force x, specific force y, specific force z: one and the same" in n for n in notes)


def test_at_rest_one_number_is_a_reading(tmp_path: Path) -> None:
    recording = make_recording("static")
    assert recording.inclination is not None
    values = recording.inclination.values.copy()
    values[:, 1] = 0.01
    still = replace(recording, inclination=Series(recording.inclination.time, values))
    inclination = read_one(write_single(still, tmp_path / "session")).inclination
    assert inclination is not None
    np.testing.assert_allclose(inclination.values[:, 1], 0.01)


def sent(folder: Path, kind: str, messages: list[Any]) -> Path:
    """A session whose only topic is the tracker's, of another type."""
    recording = replace(
        make_recording(), tension={}, exciter_force=None, exciter_shaft=None, imu=None, inclination=None
    )
    write_single(recording, folder)
    bag = folder / recording.name
    for file in bag.iterdir():
        file.unlink()
    bag.rmdir()
    with Writer(bag, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(POSE, kind, typestore=TYPESTORE)
        for index, message in enumerate(messages):
            stamp = START_NS + round(1e9 * index / RATE)
            writer.write(connection, stamp, TYPESTORE.serialize_cdr(message, kind))
    return folder


def swing() -> np.ndarray:
    return 0.1 * np.sin(2.0 * np.pi * 0.7 * np.arange(90) / RATE) + 1e-4 * np.random.default_rng(1).normal(
        size=90
    )


def test_a_marker_is_a_point(tmp_path: Path) -> None:
    kind, types = "geometry_msgs/msg/PointStamped", TYPESTORE.types
    messages = []
    for index, x in enumerate(swing()):
        seconds, nanoseconds = divmod(START_NS + round(1e9 * index / RATE), 1_000_000_000)
        time = types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
        header = types["std_msgs/msg/Header"](stamp=time, frame_id="tracker")
        point = types["geometry_msgs/msg/Point"](x=x, y=2.0 * x, z=float("nan"))
        messages.append(types[kind](header=header, point=point))
    mocap = read_one(sent(tmp_path / "session", kind, messages)).mocap
    assert mocap is not None
    np.testing.assert_allclose(mocap.values[:, 0], swing())
    np.testing.assert_allclose(mocap.values[:, 1], 2.0 * swing())
    assert np.isnan(mocap.values[:, 2:]).all()


def test_an_angle_is_a_turn_about_the_trackers_z(tmp_path: Path) -> None:
    kind = "std_msgs/msg/Float64"
    messages = [TYPESTORE.types[kind](data=float(angle)) for angle in swing()]
    mocap = read_one(sent(tmp_path / "session", kind, messages)).mocap
    assert mocap is not None
    assert np.isnan(mocap.values[:, :5]).all()
    np.testing.assert_allclose(2.0 * np.arctan2(mocap.values[:, 5], mocap.values[:, 6]), swing())
    # Without a header the recorder's times stand for stamps
    np.testing.assert_allclose(mocap.time, np.arange(90) / RATE, atol=1e-8)


def test_a_type_that_says_nothing_of_a_pose_is_refused(tmp_path: Path) -> None:
    kind = "std_msgs/msg/Float32"
    messages = [TYPESTORE.types[kind](data=float(angle)) for angle in swing()]
    folder = sent(tmp_path / "session", kind, messages)
    with pytest.raises(InputError, match=r"PoseStamped or .*PointStamped or .*Float64"):
        read_session(folder)


def test_what_is_measured_in_part_may_move_and_may_rest(tmp_path: Path) -> None:
    recording = make_recording("static")
    assert recording.inclination is not None
    values = recording.inclination.values.copy()
    values[:, 0] = np.nan
    session = read_session(
        write_single(
            replace(recording, inclination=Series(recording.inclination.time, values)), tmp_path / "s"
        )
    )
    seen = observe_static(session.recordings[0], session.rig)
    assert np.isnan(seen.inclination[0])
    assert seen.inclination[1] == pytest.approx(float(np.mean(values[:, 1])))
    values[:, 1] += np.linspace(0.0, 0.05, len(values))
    moving = replace(session.recordings[0], inclination=Series(recording.inclination.time, values))
    motion = first_motion(moving, session.rig)
    assert motion is not None
    assert motion.startswith("inclination y varies")
