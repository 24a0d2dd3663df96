"""Bags as they come: whatever can be read of them is read, and what could not is said."""

from __future__ import annotations

import dataclasses
import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from zlib import crc32

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from session_samples import edit_yaml, make_recording, rewrite, write_single

from rig_identification.errors import InputError
from rig_identification.raw import RawRecording
from rig_identification.recording import Session
from rig_identification.report import render_report
from rig_identification.result import Identification
from rig_identification.session import clean, read_raw, read_session
from rig_identification.session.messages import TYPESTORE
from rig_identification.session.unpacking import Damaged, most_unpacked, unpacked, zstd

STORAGES = [
    ("mcap", "none"),
    ("mcap", "storage"),
    ("mcap", "file"),
    ("mcap", "message"),
    ("sqlite3", "none"),
    ("sqlite3", "file"),
    ("sqlite3", "message"),
]
ROS1 = get_typestore(Stores.ROS1_NOETIC)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    """Session of one run of 4 s by storage and compression, to be copied."""
    made: dict[tuple[str, str], Path] = {}

    def make(storage: str, compression: str) -> Path:
        if (storage, compression) not in made:
            folder = tmp_path_factory.mktemp(f"{storage}_{compression}") / "session"
            recording = make_recording(seconds=4.0, seed=2)
            made[storage, compression] = write_single(
                recording, folder, storage=storage, compression=compression
            )
        return made[storage, compression]

    return make


@pytest.fixture
def copied(written: Callable[[str, str], Path], tmp_path: Path) -> Callable[..., Path]:
    """A copy of such a session that may be damaged."""
    return lambda storage="mcap", compression="none": Path(
        shutil.copytree(written(storage, compression), tmp_path / "session")
    )


def bag_file(folder: Path) -> Path:
    return next(file for file in (folder / "dynamic_2").iterdir() if file.name != "metadata.yaml")


def point_at(folder: Path, bag: str) -> None:
    edit_yaml(folder / "session.yaml", lambda document: document["recordings"][0].update(bag=bag))


def read_one(folder: Path) -> RawRecording:
    (recording,) = read_raw(folder).recordings
    return recording


def read_or_refusal(folder: Path) -> RawRecording | str:
    """The recording, as it is read and cleaned, or the words in which it is refused."""
    try:
        raw = read_raw(folder)
        clean(raw)
    except InputError as error:
        return str(error)
    return raw.recordings[0]


def assert_same(read: RawRecording, original: RawRecording) -> None:
    assert [c.topic for c in read.channels] == [c.topic for c in original.channels]
    for one, other in zip(read.channels, original.channels, strict=True):
        np.testing.assert_array_equal(one.stamp_ns, other.stamp_ns)
        np.testing.assert_array_equal(one.received_ns, other.received_ns)
        np.testing.assert_array_equal(one.values, other.values)


def assert_beginning(read: RawRecording, original: RawRecording, share: float = 0.0) -> None:
    """Of every channel the first messages, and at least ``share`` of them."""
    whole = {channel.topic: channel for channel in original.channels}
    for one in read.channels:
        count = len(one.stamp_ns)
        assert share * len(whole[one.topic].stamp_ns) - 1 <= count
        np.testing.assert_array_equal(one.stamp_ns, whole[one.topic].stamp_ns[:count])
        np.testing.assert_array_equal(one.values, whole[one.topic].values[:count])
    assert read.channels or share <= 0.0


def said(recording: RawRecording, words: str) -> bool:
    return any(words in note for note in recording.notes)


@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_a_whole_bag_has_nothing_to_be_said(written: Any, storage: str, compression: str) -> None:
    assert read_one(written(storage, compression)).notes == ()


@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_a_bag_without_metadata(written: Any, copied: Any, storage: str, compression: str) -> None:
    folder = copied(storage, compression)
    (folder / "dynamic_2" / "metadata.yaml").unlink()
    read = read_one(folder)
    assert_same(read, read_one(written(storage, compression)))
    assert said(read, "dynamic_2: metadata.yaml is missing")


@pytest.mark.parametrize("text", ["a: [", "rosbag2_bagfile_information: 7", "", "\x00", "- 1", "b: {}"])
def test_metadata_that_are_none(written: Any, copied: Any, text: str) -> None:
    folder = copied()
    (folder / "dynamic_2" / "metadata.yaml").write_text(text)
    read = read_one(folder)
    assert_same(read, read_one(written("mcap", "none")))
    assert said(read, "metadata.yaml")


@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_a_file_in_place_of_a_folder(written: Any, copied: Any, storage: str, compression: str) -> None:
    folder = copied(storage, compression)
    point_at(folder, f"dynamic_2/{bag_file(folder).name}")
    assert_same(read_one(folder), read_one(written(storage, compression)))


def as_version(document: dict[str, Any], version: int) -> None:
    """Metadata as that version of rosbag2 wrote them, by what rosbags' reader says of the versions."""
    bag = document["rosbag2_bagfile_information"]
    bag["version"] = version
    for item in bag["topics_with_message_count"]:
        topic = item["topic_metadata"]
        if version < 9:
            topic["offered_qos_profiles"] = ""
        for key, since in (("type_description_hash", 7), ("offered_qos_profiles", 4)):
            if version < since:
                del topic[key]
    for key, since in (("ros_distro", 8), ("custom_data", 6), ("files", 5)):
        if version < since:
            del bag[key]
    if version < 4:
        bag["relative_file_paths"] = [f"dynamic_2/{name}" for name in bag["relative_file_paths"]]
    if version < 3:
        del bag["compression_format"], bag["compression_mode"]


@pytest.mark.parametrize("version", range(1, 12))
def test_every_version_of_the_metadata(written: Any, copied: Any, version: int) -> None:
    folder = copied("sqlite3", "none")
    edit_yaml(folder / "dynamic_2" / "metadata.yaml", lambda document: as_version(document, version))
    read = read_one(folder)
    assert_same(read, read_one(written("sqlite3", "none")))
    assert bool(read.notes) == (version > 9)
    assert version <= 9 or said(read, f"version {version}, newer than 9")


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("name", ["", "my_plugin", "rosbag_v2"])
def test_a_storage_of_another_name(written: Any, copied: Any, storage: str, name: str) -> None:
    folder = copied(storage)
    file = bag_file(folder)
    file.rename(file.with_suffix(".data"))

    def edit(document: dict[str, Any]) -> None:
        bag = document["rosbag2_bagfile_information"]
        bag.update(storage_identifier=name, relative_file_paths=[file.with_suffix(".data").name])

    edit_yaml(folder / "dynamic_2" / "metadata.yaml", edit)
    read = read_one(folder)
    assert_same(read, read_one(written(storage, "none")))
    assert said(read, f"is read as {storage} by its first bytes")


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("described", [True, False])
def test_a_bag_of_several_files(written: Any, copied: Any, storage: str, described: bool) -> None:
    """Eleven parts, so that the order of the names is not that of the letters; one topic starts late."""
    folder = copied(storage)
    bag, whole = folder / "dynamic_2", read_one(written(storage, "none"))
    original = bag.rename(folder / "original")
    bag.mkdir()
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with AnyReader([original]) as reader:
        kinds = {item.topic: item.msgtype for item in reader.connections}
        messages = list(reader.messages())
    parts = np.array_split(np.arange(len(messages)), 11)
    for number, part in enumerate(parts):
        aside = folder / f"dynamic_2_{number}"
        with Writer(aside, version=9, storage_plugin=plugin) as writer:
            to: dict[str, Any] = {}
            for connection, received, data in (messages[i] for i in part):
                topic = connection.topic
                if topic not in to:
                    to[topic] = writer.add_connection(topic, kinds[topic], typestore=TYPESTORE)
                writer.write(to[topic], received, data)
        file = next(file for file in aside.iterdir() if file.name != "metadata.yaml")
        file.rename(bag / file.name)
    if described:
        names = [f"dynamic_2_{number}{file.suffix}" for number in range(11)]
        shutil.copy(original / "metadata.yaml", bag)
        edit_yaml(
            bag / "metadata.yaml",
            lambda document: document["rosbag2_bagfile_information"].update(relative_file_paths=names),
        )
    read = read_one(folder)
    by_topic = {channel.topic: channel for channel in read.channels}
    assert_same(dataclasses.replace(read, channels=tuple(by_topic[c.topic] for c in whole.channels)), whole)
    assert described or said(read, "were read as the parts of one bag")


def test_a_part_that_is_missing_is_said(copied: Any) -> None:
    folder = copied()
    names = [bag_file(folder).name, "dynamic_2_1.mcap"]
    edit_yaml(
        folder / "dynamic_2" / "metadata.yaml",
        lambda document: document["rosbag2_bagfile_information"].update(relative_file_paths=names),
    )
    assert said(read_one(folder), "dynamic_2_1.mcap of metadata.yaml is missing")


def test_a_renamed_file_is_read(written: Any, copied: Any) -> None:
    folder = copied()
    bag_file(folder).rename(folder / "dynamic_2" / "renamed.mcap")
    read = read_one(folder)
    assert_same(read, read_one(written("mcap", "none")))
    assert said(read, "renamed.mcap was read without it")


@pytest.mark.parametrize("described", [True, False])
def test_a_file_unpacked_beside_itself_is_read_once(written: Any, copied: Any, described: bool) -> None:
    """What ``ros2 bag play`` leaves behind."""
    folder = copied("mcap", "file")
    packed = bag_file(folder)
    packed.with_suffix("").write_bytes(zstd.decompress(packed.read_bytes()))
    if not described:
        (folder / "dynamic_2" / "metadata.yaml").unlink()
    read = read_one(folder)
    assert_same(read, read_one(written("mcap", "file")))
    assert said(read, "is no part of the bag, or a copy")


def test_a_file_named_without_its_ending(copied: Any) -> None:
    folder = copied()
    shutil.move(bag_file(folder), folder / "other.mcap")
    point_at(folder, "other")
    with pytest.raises(InputError, match=r"other: bag does not exist; .*; did you mean other\.mcap\?"):
        read_raw(folder)


def test_big_endian_messages(written: Any, copied: Any) -> None:
    folder = copied()
    original = (folder / "dynamic_2").rename(folder / "original")
    with (
        AnyReader([original]) as reader,
        Writer(folder / "dynamic_2", version=9, storage_plugin=StoragePlugin.MCAP) as writer,
    ):
        kinds = {item.topic: item.msgtype for item in reader.connections}
        to = {topic: writer.add_connection(topic, kind, typestore=TYPESTORE) for topic, kind in kinds.items()}
        for connection, received, data in reader.messages():
            message = TYPESTORE.deserialize_cdr(data, connection.msgtype)
            swapped = TYPESTORE.serialize_cdr(message, connection.msgtype, little_endian=False)
            writer.write(to[connection.topic], received, swapped)
    assert_same(read_one(folder), read_one(written("mcap", "none")))


def test_an_empty_topic_is_as_if_not_recorded(copied: Any) -> None:
    folder = copied()
    rewrite(
        folder / "dynamic_2",
        lambda topic, index, message: None if topic == "/rig/imu/data_raw" else message,
    )
    raw = read_raw(folder)
    assert raw.recordings[0].channel("imu") is None
    assert raw.recordings[0].listed["/rig/imu/data_raw"] == "sensor_msgs/msg/Imu"
    recording = clean(raw).recordings[0]
    assert recording.imu is None
    assert recording.tension
    assert recording.notes == ("dynamic_2: /rig/imu/data_raw has no message: taken as not recorded",)


# What was cut off or damaged


@pytest.mark.parametrize(
    ("share", "described"),
    [(0.02, True), (0.2, False), (0.45, True), (0.7, False), (0.9, True), (0.999, False)],
)
@pytest.mark.parametrize(("storage", "compression"), STORAGES)
def test_a_bag_cut_off_is_read_to_its_end(
    written: Any, copied: Any, storage: str, compression: str, share: float, described: bool
) -> None:
    """All that stands before the cut, less what a compressor had not handed on and a table's last pages."""
    folder = copied(storage, compression)
    file = bag_file(folder)
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    if not described:
        (folder / "dynamic_2" / "metadata.yaml").unlink()
    read = read_or_refusal(folder)
    if isinstance(read, str):
        assert share < 0.3
        assert "truncated" in read
        return
    slack = {"none": 0.1, "message": 0.1, "storage": 0.35, "file": 0.35}[compression]
    whole = read_one(written(storage, compression))
    assert_beginning(read, whole, share - slack)
    assert said(read, "truncated") or said(read, "its index is cut off")
    fewer = sum(read.counts.values()) < sum(whole.counts.values())
    assert said(read, "messages were read of the") == (described and fewer)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_an_end_filled_with_zeros_is_a_cut(written: Any, copied: Any, storage: str) -> None:
    """A file system after a loss of power: the length is there, the last blocks are not."""
    folder = copied(storage)
    file = bag_file(folder)
    content = file.read_bytes()
    keep = len(content) // 2 // 4096 * 4096
    file.write_bytes(content[:keep] + bytes(len(content) - keep))
    read = read_one(folder)
    assert_beginning(read, read_one(written(storage, "none")), 0.2)
    assert said(read, "truncated")


def test_pages_missing_below_the_first_level_of_a_table(tmp_path: Path) -> None:
    """A run long enough for pages that point to pages that point to rows."""
    recording = make_recording(seconds=14.0)
    folder = write_single(recording, tmp_path / "out", storage="sqlite3")
    whole = read_one(folder)
    file = next((folder / recording.name).glob("*.db3"))
    content = file.read_bytes()
    for share in (0.9, 0.5, 0.2):
        file.write_bytes(content[: int(share * len(content))])
        assert_beginning(read_one(folder), whole, share - 0.1)


def test_rows_on_several_pages_before_the_cut(written: Any, copied: Any) -> None:
    """Pictures between the messages, which only a query takes from the file."""
    folder = copied("sqlite3")
    picture = bytes(20_000)
    with closing(sqlite3.connect(bag_file(folder))) as database:
        database.execute("INSERT INTO topics VALUES (99, '/camera', 'sensor_msgs/msg/Image', 'cdr', '', '')")
        rows = database.execute("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id").fetchall()
        database.execute("DELETE FROM messages")
        mixed = [
            row for k, one in enumerate(rows) for row in [one[1:], (99, one[2], picture)][: 1 + (k % 50 == 7)]
        ]
        database.executemany("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", mixed)
        database.commit()
        database.execute("VACUUM")
    whole = read_one(folder)
    assert_same(whole, read_one(written("sqlite3", "none")))
    assert whole.counts["/camera"] == sum(row[0] == 99 for row in mixed)
    content = bag_file(folder).read_bytes()
    bag_file(folder).write_bytes(content[: len(content) // 2])
    read = read_one(folder)
    assert_beginning(read, whole, 0.4)
    assert said(read, "truncated")


@pytest.mark.parametrize("mode", ["wal", "persist"])
def test_a_database_whose_recorder_was_killed(written: Any, copied: Any, mode: str) -> None:
    """What it wrote last stands in a log beside the database, and nothing is written there."""
    folder = copied("sqlite3")
    file = bag_file(folder)
    killed = folder / "killed"
    with closing(sqlite3.connect(file)) as database:
        database.execute(f"PRAGMA journal_mode = {mode}")
        rows = database.execute("SELECT id, topic_id, timestamp, data FROM messages").fetchall()
        database.execute("PRAGMA cache_size = 1")
        database.execute("DELETE FROM messages WHERE id > 100")
        if mode == "wal":  # the log holds the last of the messages; without it the database stands at 100
            database.commit()
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows[100:])
            database.commit()
        shutil.copytree(folder / "dynamic_2", killed)  # under way: the journal would take the deletion back
        database.rollback()
    shutil.rmtree(folder / "dynamic_2")
    killed.rename(folder / "dynamic_2")
    before = {path.name: path.read_bytes() for path in (folder / "dynamic_2").iterdir()}
    read = read_one(folder)
    assert_same(read, read_one(written("sqlite3", "none")))
    assert said(read, "was not closed by its recorder: read with")
    assert {path.name: path.read_bytes() for path in (folder / "dynamic_2").iterdir()} == before


def test_metadata_that_promise_more_are_said(copied: Any) -> None:
    folder = copied()

    def edit(document: dict[str, Any]) -> None:
        document["rosbag2_bagfile_information"]["topics_with_message_count"][0]["message_count"] += 7

    edit_yaml(folder / "dynamic_2" / "metadata.yaml", edit)
    assert said(read_one(folder), "messages were read of the")


# mcap files of other writers


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def text(word: str | bytes) -> bytes:
    data = word.encode() if isinstance(word, str) else word
    return struct.pack("<I", len(data)) + data


def chunk(records: bytes, compression: str = "", *, checksum: int | None = None, size: int = -1) -> bytes:
    pack = {"": bytes, "zstd": zstd.compress, "lz4": lz4.frame.compress}
    packed = pack[compression](records) if compression in pack else records
    head = struct.pack(
        "<QQQI", 0, 0, len(records) if size < 0 else size, crc32(records) if checksum is None else checksum
    )
    return record(0x06, head + text(compression) + struct.pack("<Q", len(packed)) + packed)


class Mcap:
    """One topic's messages as records of an mcap file."""

    MAGIC = b"\x89MCAP0\r\n"
    END = record(0x0F, bytes(4)) + record(0x02, bytes(20)) + MAGIC

    def __init__(self, encoding: str = "cdr", kind: str = "sensor_msgs/msg/Imu") -> None:
        self.start = self.MAGIC + record(0x01, text("ros2") + text("test"))
        schema = record(0x03, struct.pack("<H", 1) + text(kind) + text("ros2msg") + text(""))
        channel = struct.pack("<HH", 7, 1) + text("/rig/imu/data_raw") + text(encoding) + text(b"")
        self.described = schema + record(0x04, channel)
        self.messages = []
        for k in range(400):
            message = imu(k)
            data = (
                TYPESTORE.serialize_cdr(message, kind)
                if encoding == "cdr"
                else TYPESTORE.cdr_to_ros1(TYPESTORE.serialize_cdr(message, kind_of(kind)), kind_of(kind))
            )
            received = 10**12 + k * 10**7
            self.messages.append(record(0x05, struct.pack("<HIQQ", 7, k, received, received) + bytes(data)))

    def chunks(self, count: int) -> Iterator[bytes]:
        for part in np.array_split(np.arange(len(self.messages)), count):
            yield b"".join(self.messages[k] for k in part)


def kind_of(kind: str) -> str:
    return kind if "/msg/" in kind else kind.replace("/", "/msg/")


def imu(k: int) -> Any:
    """Message k of an IMU: its angular rate about x is k."""
    types = TYPESTORE.types
    vector, unknown = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    stamp = types["builtin_interfaces/msg/Time"](sec=1000 + k // 100, nanosec=k % 100 * 10**7)
    return types["sensor_msgs/msg/Imu"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu"),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=unknown, angular_velocity=vector(x=float(k), y=0.0, z=0.0),
        angular_velocity_covariance=unknown, linear_acceleration=vector(x=0.0, y=0.0, z=9.8),
        linear_acceleration_covariance=unknown,
    )  # fmt: skip


def rates(folder: Path, content: bytes) -> tuple[list[int], RawRecording]:
    """Angular rates about x that are read of a file with that content, and the recording."""
    bag = folder / "dynamic_2"
    shutil.rmtree(bag)
    bag.mkdir()
    (bag / "dynamic_2.mcap").write_bytes(content)
    read = read_one(folder)
    channel = read.channel("imu")
    return ([] if channel is None else channel.values[:, 0].astype(int).tolist()), read


@pytest.mark.parametrize("compression", ["", "zstd", "lz4"])
def test_chunks_of_every_compression_without_an_index(copied: Any, compression: str) -> None:
    file = Mcap()
    chunks = [chunk(part, compression) for part in file.chunks(5)]
    content = file.start + file.described + b"".join(chunks) + file.END
    read, recording = rates(copied(), content)
    assert read == list(range(400))
    assert said(recording, "has no index: it was read from beginning to end")


def test_messages_outside_of_chunks_and_topics_inside(copied: Any) -> None:
    file = Mcap()
    parts = list(file.chunks(4))
    content = file.start + chunk(file.described + parts[0], "lz4") + parts[1] + chunk(parts[2]) + parts[3]
    assert rates(copied(), content + file.END)[0] == list(range(400))


def test_messages_as_of_ros_1_in_mcap(copied: Any) -> None:
    file = Mcap("ros1", "sensor_msgs/Imu")
    content = file.start + file.described + b"".join(file.messages) + file.END
    assert rates(copied(), content)[0] == list(range(400))


def test_messages_of_an_encoding_that_is_not_read(copied: Any) -> None:
    file = Mcap()
    described = file.described.replace(text("cdr"), text("js0"))
    with pytest.raises(InputError, match="/rig/imu/data_raw: messages are encoded as js0, not cdr"):
        rates(copied(), file.start + described + b"".join(file.messages) + file.END)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda part: chunk(part, checksum=1),
        lambda part: chunk(part, size=len(part) + 1),
        lambda part: chunk(part, "zstd", size=1 << 60),
        lambda part: chunk(part, "brotli"),
        lambda part: chunk(part, "lz4")[:200] + bytes(50) + chunk(part, "lz4")[250:],
    ],
)
def test_a_damaged_chunk_is_left_out_alone(copied: Any, spoil: Callable[[bytes], bytes]) -> None:
    file = Mcap()
    parts = list(file.chunks(4))
    content = file.start + file.described + chunk(parts[0]) + spoil(parts[1]) + chunk(parts[2]) + file.END
    read, recording = rates(copied(), content)
    assert read == [*range(100), *range(200, 300)]
    assert said(recording, "is damaged: 1 of 3 chunks are left out")


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_cannot_claim_any_amount_of_memory(compression: str) -> None:
    packed = {"zstd": zstd.compress, "lz4": lz4.frame.compress}[compression](bytes(10**8))
    assert len(unpacked(compression, packed, 1000)) <= 1001  # more than it says
    with pytest.raises(Damaged):
        unpacked(compression, packed, most_unpacked(len(packed)) + 1)  # more than a recorder's chunk
    assert len(unpacked(compression, packed, 10**8)) == 10**8


# ROS 1


def write_rosbag1(original: Path, file: Path, compression: str) -> None:
    """The messages of a rosbag2 folder as a ROS 1 bag."""
    writer = Rosbag1Writer(file)
    if compression != "none":
        writer.set_compression(Rosbag1Writer.CompressionFormat[compression])
    with AnyReader([original]) as reader, writer:
        kinds = {item.topic: item.msgtype for item in reader.connections}
        to = {topic: writer.add_connection(topic, kind, typestore=ROS1) for topic, kind in kinds.items()}
        for connection, received, data in reader.messages():
            writer.write(to[connection.topic], received, TYPESTORE.cdr_to_ros1(data, connection.msgtype))


@pytest.fixture(scope="module")
def rosbag1(written: Any, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    out = {}
    for compression in ("none", "BZ2", "LZ4"):
        file = tmp_path_factory.mktemp("rosbag1") / "run.bag"
        write_rosbag1(written("mcap", "none") / "dynamic_2", file, compression)
        out[compression] = file.read_bytes()
    return out


def with_rosbag1(folder: Path, content: bytes) -> Path:
    shutil.rmtree(folder / "dynamic_2")
    (folder / "run.bag").write_bytes(content)
    point_at(folder, "run.bag")
    return folder


@pytest.mark.parametrize("compression", ["none", "BZ2", "LZ4"])
def test_a_bag_of_ros_1(written: Any, copied: Any, rosbag1: dict[str, bytes], compression: str) -> None:
    read = read_one(with_rosbag1(copied(), rosbag1[compression]))
    assert_same(read, read_one(written("mcap", "none")))
    assert read.notes == ()


@pytest.mark.parametrize("share", [0.1, 0.4, 0.8, 0.97])
@pytest.mark.parametrize("compression", ["none", "BZ2", "LZ4"])
def test_a_bag_of_ros_1_cut_off(
    written: Any, copied: Any, rosbag1: dict[str, bytes], compression: str, share: float
) -> None:
    content = rosbag1[compression]
    read = read_or_refusal(with_rosbag1(copied(), content[: int(share * len(content))]))
    if isinstance(read, str):
        assert share < (0.3 if compression == "none" else 0.5)  # shorter than a second, or than a block
        assert "truncated" in read
        return
    slack = 0.1 if compression == "none" else 0.6  # a compressor's block: bz2 has 900 kB
    assert_beginning(read, read_one(written("mcap", "none")), share - slack)
    assert said(read, "run.bag is truncated")


def test_a_bag_of_ros_1_that_was_not_closed(written: Any, copied: Any, rosbag1: dict[str, bytes]) -> None:
    content = rosbag1["none"]
    at = content.index(b"index_pos=") + len(b"index_pos=")
    end = int.from_bytes(content[at : at + 8], "little")
    read = read_one(with_rosbag1(copied(), content[:at] + bytes(8) + content[at + 8 : end]))
    assert_same(read, read_one(written("mcap", "none")))
    assert said(read, "was not closed by its recorder")


# Whatever else


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("storage", "compression"), [*STORAGES, ("rosbag1", "none"), ("rosbag1", "LZ4")])
def test_any_damage_is_read_or_refused_in_one_line(
    copied: Any, rosbag1: dict[str, bytes], storage: str, compression: str, seed: int
) -> None:
    if storage == "rosbag1":
        folder = with_rosbag1(copied(), rosbag1[compression])
        file = folder / "run.bag"
    else:
        folder = copied(storage, compression)
        file = bag_file(folder)
    content = np.frombuffer(file.read_bytes(), np.uint8)
    rng = np.random.default_rng(seed)
    for _ in range(3):
        spoilt = content.copy()
        places = rng.integers(0, len(content), 1 + 9 * (seed % 2))
        places[0] %= 4096  # where the file says how it is laid out
        spoilt[places] = rng.integers(0, 256, len(places))
        file.write_bytes(spoilt.tobytes())
        read = read_or_refusal(folder)
        assert isinstance(read, RawRecording) or "\n" not in read


def test_how_a_bag_was_read_reaches_the_report(
    copied: Any, session: Session, identification: Identification
) -> None:
    folder = copied()
    (folder / "dynamic_2" / "metadata.yaml").unlink()
    (recording,) = read_session(folder).recordings
    assert recording.notes == read_one(folder).notes != ()
    first = dataclasses.replace(session.recordings[0], notes=recording.notes)
    noted = dataclasses.replace(session, recordings=(first, *session.recordings[1:]))
    assert f"<li>{recording.notes[0].replace(chr(39), '&#39;')}</li>" in render_report(identification, noted)
    assert recording.notes[0][:20] not in render_report(identification, session)
