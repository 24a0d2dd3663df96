"""What is written is read back to the last bit, whatever the storage, compression and layout."""

from __future__ import annotations

import dataclasses
import shutil
import sqlite3
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import McapWriter
from session_samples import CABLES, START_NS, edit_yaml, make_recording, make_session, rewrite, write_single

from rig_identification.errors import InputError
from rig_identification.recording import Recording, Series, Session
from rig_identification.session import read_session, write_session
from rig_identification.session.messages import TYPESTORE

CHANNELS = ("exciter_force", "exciter_shaft", "imu", "inclination", "mocap", "ground_truth")
WAYS = [
    (storage, compression)
    for storage in ("mcap", "sqlite3")
    for compression in ("none", "message", "file", "storage")
    if (storage, compression) != ("sqlite3", "storage")
]


@pytest.fixture(scope="module")
def session() -> Session:
    return make_session()


def assert_same_numbers(read: Recording, written: Recording) -> None:
    assert (read.name, read.kind, read.holdout) == (written.name, written.kind, written.holdout)
    assert read.start_ns == written.start_ns
    assert read.duration == written.duration
    assert read.tension.keys() == written.tension.keys()
    pairs = [(read.tension[cable], written.tension[cable]) for cable in written.tension]
    pairs += [(getattr(read, channel), getattr(written, channel)) for channel in CHANNELS]
    for one, other in pairs:
        assert (one is None) == (other is None)
        if one is not None:
            np.testing.assert_array_equal(one.time, other.time)
            np.testing.assert_array_equal(one.values, other.values)


def assert_same(read: Session, written: Session) -> None:
    assert repr(read.rig) == repr(written.rig)
    for one, other in zip(read.recordings, written.recordings, strict=True):
        assert_same_numbers(one, other)
        assert repr(one.dummy) == repr(other.dummy)


@pytest.mark.parametrize(("storage", "compression"), WAYS)
def test_every_storage_and_compression(
    session: Session, tmp_path: Path, storage: str, compression: str
) -> None:
    folder = write_session(session, tmp_path / "out", storage=storage, compression=compression)
    assert_same(read_session(folder), session)
    assert_same(read_session(folder / "session.yaml"), session)


def test_messages_that_overtake_each_other_are_put_back(session: Session, tmp_path: Path) -> None:
    folder = write_session(session, tmp_path / "out", receive_jitter=0.02)
    read = read_session(folder)
    assert_same(read, session)
    tension = read.recordings[1].quality[0]
    assert tension.backward > 100
    assert "late" in tension.notes[0]


def test_chunks_compressed_by_lz4(session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = McapWriter.__init__

    def with_lz4(self: McapWriter, *arguments: object) -> None:
        plain(self, *arguments)
        self.compression, self.compressor = "lz4", lz4.frame.compress

    monkeypatch.setattr(McapWriter, "__init__", with_lz4)
    folder = write_session(session, tmp_path / "out")
    assert b"lz4" in next((folder / "dynamic_2").glob("*.mcap")).read_bytes()
    assert_same(read_session(folder), session)


def test_messages_outside_of_chunks(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def loose(self: McapWriter) -> None:
        self.bio.write(self.chunk.bio.getvalue())
        self.chunk.bio.seek(0)
        self.chunk.bio.truncate()

    monkeypatch.setattr(McapWriter, "close_chunk", loose)
    folder = write_session(session, tmp_path / "out")
    assert_same(read_session(folder), session)


def test_sqlite3_of_another_layout_is_read_by_query(session: Session, tmp_path: Path) -> None:
    folder = write_session(session, tmp_path / "out", storage="sqlite3")
    file = folder / "dynamic_2" / "dynamic_2.db3"
    with sqlite3.connect(file) as database:
        database.execute("ALTER TABLE messages RENAME TO old")
        database.execute("CREATE TABLE messages(topic_id INTEGER, id INTEGER, data BLOB, timestamp INTEGER)")
        database.execute("INSERT INTO messages SELECT topic_id, id, data, timestamp FROM old")
        database.execute("DROP TABLE old")
    database.close()
    assert_same(read_session(folder), session)


def test_a_long_message_of_another_topic_among_ours(session: Session, tmp_path: Path) -> None:
    """A camera's image spills over several pages of the database."""
    folder = write_session(session, tmp_path / "out", storage="sqlite3")
    with sqlite3.connect(folder / "dynamic_2" / "dynamic_2.db3") as database:
        database.execute("INSERT INTO topics SELECT 99, '/camera', type, 'cdr', '', '' FROM topics LIMIT 1")
        database.execute("UPDATE messages SET id = id + 100000 WHERE id > 1000")
        database.execute("INSERT INTO messages VALUES(50000, 99, 5, zeroblob(100000))")
    database.close()
    assert_same(read_session(folder), session)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_split_into_files(tmp_path: Path, storage: str) -> None:
    whole = make_recording(seconds=3.0, seed=6)
    folder = write_single(whole, tmp_path / "out", storage=storage)
    halves = [write_single(half, tmp_path / half.name, storage=storage) for half in halved(whole)]
    bag = folder / whole.name
    next(path for path in bag.iterdir() if path.name != "metadata.yaml").unlink()
    for half in halves:
        (file,) = (path for path in (half / half.name).iterdir() if path.name != "metadata.yaml")
        file.rename(bag / file.name)
    names = sorted(path.name for path in bag.iterdir() if path.name != "metadata.yaml")

    def edit(document: dict[str, dict[str, object]]) -> None:
        document["rosbag2_bagfile_information"]["relative_file_paths"] = names

    edit_yaml(bag / "metadata.yaml", edit)
    assert_same_numbers(read_session(folder).recordings[0], whole)


def halved(whole: Recording) -> list[Recording]:
    """The samples before and from 1.5 s on."""

    def part(series: Series, late: bool) -> Series:
        chosen = (series.time >= 1.5) == late
        return Series(series.time[chosen], series.values[chosen])

    return [
        dataclasses.replace(
            whole,
            name=f"half_{int(late)}",
            tension={cable: part(series, late) for cable, series in whole.tension.items()},
            **{channel: part(getattr(whole, channel), late) for channel in CHANNELS},
        )
        for late in (False, True)
    ]


def test_layouts_that_vary_within_a_topic(tmp_path: Path) -> None:
    """Frame ids of changing length: equal bytes a message but other offsets, and other lengths."""
    written = make_recording(seed=4, seconds=1.2)
    folder = write_single(written, tmp_path / "out")

    def edit(topic: str, index: int, message: object) -> object:
        header = dataclasses.replace(message.header, frame_id="x" * (index % 11))
        return dataclasses.replace(message, header=header)

    rewrite(folder / written.name, edit)
    assert_same_numbers(read_session(folder).recordings[0], written)


def test_joint_states_with_more_joints_and_no_rate(tmp_path: Path) -> None:
    written = make_recording(seed=4, seconds=1.2)
    folder = write_single(written, tmp_path / "out")

    def edit(topic: str, index: int, message: object) -> object:
        if not topic.endswith("joint_states"):
            return message
        return dataclasses.replace(message, name=["shaft", "belt"], velocity=np.zeros(0))

    rewrite(folder / written.name, edit)
    recording = read_session(folder).recordings[0]
    assert recording.exciter_shaft is None
    account = next(item for item in recording.quality if item.topic.endswith("joint_states"))
    assert account.not_finite == account.count
    assert "not measured" in account.notes[0]


def test_rosbags_reads_what_was_written(session: Session, tmp_path: Path) -> None:
    folder = write_session(session, tmp_path / "out")
    written = session.recordings[1]
    first: dict[str, object] = {}
    with AnyReader([folder / written.name]) as reader:
        for connection, received, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
            assert received > stamp >= START_NS
            first.setdefault(connection.topic, message)
    wrench = first["/rig/cable_1/wrench"].wrench
    assert wrench.force.z == written.tension["cable_1"].values[0, 0]
    assert np.isnan([wrench.force.x, wrench.force.y, wrench.torque.z]).all()
    imu = first["/rig/imu/data_raw"]
    assert imu.orientation_covariance[0] == -1.0
    measured = [imu.angular_velocity.x, imu.linear_acceleration.z]
    assert measured == [written.imu.values[0, 0], written.imu.values[0, 5]]
    assert first["/rig/inclinometer/angles"].vector.z == 0.0
    shaft = first["/rig/exciter/joint_states"]
    assert [shaft.position[0], shaft.velocity[0]] == written.exciter_shaft.values[0].tolist()
    truth = first["/rig/ground_truth/odometry"]
    assert (truth.header.frame_id, truth.child_frame_id) == ("world", "body")
    assert truth.twist.twist.angular.z == written.ground_truth.values[0, 12]
    assert first["/rig/mocap/pose"].pose.orientation.w == written.mocap.values[0, 6]


def test_other_namespace_and_names(session: Session, tmp_path: Path) -> None:
    folder = write_session(session, tmp_path / "out", namespace="/lab/hall_2")
    assert_same(read_session(folder, namespace="lab/hall_2/"), session)
    names = {"imu/data_raw": "/lab/hall_2/imu/data_raw", "/rig/mocap/pose": "lab/hall_2/mocap/pose"}
    recording = read_session(folder, topics=names).recordings[1]
    assert recording.imu is not None
    assert recording.mocap is not None
    assert recording.tension == {}


def test_missing_topics_are_fine(tmp_path: Path) -> None:
    written = make_recording(tension={}, exciter_force=None, exciter_shaft=None, imu=None, ground_truth=None)
    written = dataclasses.replace(written, inclination=None)
    read = read_session(write_single(written, tmp_path / "out")).recordings[0]
    assert_same_numbers(read, written)
    assert [account.topic for account in read.quality] == ["/rig/mocap/pose"]


def test_an_existing_folder_is_kept(session: Session, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "notes.txt").write_text("keep")
    with pytest.raises(InputError, match="exists already"):
        write_session(session, folder)
    assert (folder / "notes.txt").read_text() == "keep"
    write_session(session, folder, overwrite=True)
    assert not (folder / "notes.txt").exists()
    assert_same(read_session(folder), session)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_failed_write_leaves_nothing(session: Session, tmp_path: Path) -> None:
    def fail(text: str) -> None:
        if "dynamic_3" in text:
            raise RuntimeError(text)

    with pytest.raises(RuntimeError):
        write_session(session, tmp_path / "out", progress=fail)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"storage": "rosbag1"}, "storage 'rosbag1' is unknown"),
        ({"compression": "gzip"}, "compression 'gzip' is unknown"),
        ({"storage": "sqlite3", "compression": "storage"}, "sqlite3 has no compression"),
    ],
)
def test_ways_of_writing_that_do_not_exist(
    session: Session, tmp_path: Path, options: dict[str, str], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        write_session(session, tmp_path / "out", **options)


@pytest.mark.parametrize("name", ["../away", "/away", ""])
def test_a_recording_stays_inside_the_session(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="rename it"):
        write_single(make_recording(name=name), tmp_path / "out")


def test_progress_names_each_bag(session: Session, tmp_path: Path) -> None:
    said: list[str] = []
    folder = write_session(session, tmp_path / "out")
    read_session(folder, progress=said.append)
    assert said == [f"reading {recording.name}" for recording in session.recordings]


def test_cables_of_the_sample_are_all_read(session: Session, tmp_path: Path) -> None:
    folder = write_session(session, tmp_path / "out")
    assert tuple(read_session(folder).recordings[0].tension) == CABLES


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_as_ros2_bag_records_it(session: Session, tmp_path: Path, storage: StoragePlugin) -> None:
    """With each publisher's quality of service, and topics that are none of the contract's between."""
    folder = write_session(session, tmp_path / "out")
    own, theirs = folder / "dynamic_2", tmp_path / "own"
    shutil.move(own, theirs)
    second, forever = QosTime(1, 0), QosTime(2147483647, 4294967295)
    offered = Qos(
        QosHistory.UNKNOWN, 0, QosReliability.RELIABLE, QosDurability.VOLATILE, forever, forever,
        QosLiveliness.AUTOMATIC, second, False,
    )  # fmt: skip
    others = {"/rosout": "rcl_interfaces/msg/Log", "/rig/odometry": "nav_msgs/msg/Odometry"}
    with AnyReader([theirs]) as reader, Writer(own, version=9, storage_plugin=storage) as writer:
        kinds = {item.topic: item.msgtype for item in reader.connections} | others
        to = {
            topic: writer.add_connection(topic, kind, typestore=TYPESTORE, offered_qos_profiles=[offered])
            for topic, kind in kinds.items()
        }
        for count, (connection, received, data) in enumerate(reader.messages()):
            writer.write(to[connection.topic], received, data)
            if count % 100 == 0:
                for topic in others:
                    writer.write(to[topic], received, b"\x00\x01\x00\x00" + bytes(32))
    assert_same(read_session(folder), session)
