"""Serialized messages of a rosbag2 folder, taken in bulk.

rosbags opens the bag: metadata, message definitions, decompressed files. Its message iterator makes several
Python objects a message; the two storages are therefore walked here, mcap chunk by chunk and sqlite3 by one
query.
"""

from __future__ import annotations

import sqlite3
import struct
import sys
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

import lz4.frame  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.reader import DirectoryReader
from rosbags.rosbag2.storage_mcap import McapReader
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

from rig_identification.errors import InputError
from rig_identification.session.fields import one_line

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

Bytes = NDArray[np.uint8]
_ROWS_AT_ONCE = 20_000
_MCAP_MESSAGE, _MCAP_CHUNK, _MCAP_DATA_END = 0x05, 0x06, 0x0F
_RECORD = struct.Struct("<BQ")  # opcode, length
_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_CHUNK = struct.Struct("<QQQII")  # start, end, uncompressed size, crc, length of the compression's name


@dataclass(frozen=True)
class MessageBlock:
    """Messages of equal length from one topic."""

    index: NDArray[np.int64]  # (n,) place of each among the topic's messages, in the order of the file
    data: Bytes  # (n, length)


@dataclass(frozen=True)
class RawTopic:
    """All serialized messages of one topic."""

    name: str
    message_type: str
    received_ns: NDArray[np.int64]  # (n,) receive times, in the order of the file
    blocks: tuple[MessageBlock, ...]  # one for each length of message

    @property
    def count(self) -> int:
        """Number of messages."""
        return len(self.received_ns)


class _Collector:
    """Gathers messages by topic and length."""

    def __init__(self) -> None:
        self.received: dict[str, list[NDArray[np.int64]]] = defaultdict(list)
        self.counts: dict[str, int] = defaultdict(int)
        self.blocks: dict[str, dict[int, list[MessageBlock]]] = defaultdict(lambda: defaultdict(list))

    def add(self, topic: str, received: list[int], messages: list[bytes]) -> None:
        """Add messages in the order of the file."""
        lengths = np.fromiter(map(len, messages), np.int64, len(messages))
        for length in np.unique(lengths):
            chosen = np.flatnonzero(lengths == length)
            joined = b"".join(messages if len(chosen) == len(messages) else [messages[i] for i in chosen])
            self._append(topic, chosen, np.frombuffer(joined, np.uint8).reshape(len(chosen), length))
        self._advance(topic, received)

    def add_slices(
        self, topic: str, received: list[int], buffer: Bytes, starts: list[int], ends: list[int]
    ) -> None:
        """Add the messages ``buffer[start:end]`` in the order of the file."""
        first = np.array(starts)
        lengths = np.array(ends) - first
        for length in np.unique(lengths):
            chosen = np.flatnonzero(lengths == length)
            windows = np.lib.stride_tricks.sliding_window_view(buffer, int(length))
            self._append(topic, chosen, windows[first[chosen]])
        self._advance(topic, received)

    def _append(self, topic: str, chosen: NDArray[np.int64], data: Bytes) -> None:
        self.blocks[topic][data.shape[1]].append(MessageBlock(chosen + self.counts[topic], data))

    def _advance(self, topic: str, received: list[int]) -> None:
        self.received[topic].append(np.array(received, np.int64))
        self.counts[topic] += len(received)

    def topic(self, name: str, message_type: str) -> RawTopic:
        """What was gathered of one topic; its pieces are given up."""
        lengths = self.blocks.pop(name, {})
        blocks = []
        for length in list(lengths):
            pieces = lengths.pop(length)
            index = np.concatenate([piece.index for piece in pieces])
            blocks.append(MessageBlock(index, np.concatenate([piece.data for piece in pieces])))
        received = self.received.pop(name, [])
        return RawTopic(
            name, message_type, np.concatenate(received or [np.zeros(0, np.int64)]), tuple(blocks)
        )


@dataclass(frozen=True)
class Bag:
    """A rosbag2 folder in memory: what it lists, and the wanted topics' messages."""

    folder: Path
    listed: dict[str, str]  # every topic of the bag -> its message type
    topics: dict[str, RawTopic]


def read_bag(folder: Path, wanted: Collection[str]) -> Bag:
    """Read the messages of the topics ``wanted`` that the bag in ``folder`` lists.

    Raises
    ------
    InputError
        No such folder, no metadata.yaml, a damaged or truncated bag, or one topic with two types.
    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: bag does not exist; correct the path in session.yaml or copy the bag there"
        )
    if not (folder / "metadata.yaml").is_file():
        raise InputError(
            f"{folder}: metadata.yaml is missing; copy it or make it anew with 'ros2 bag reindex'"
        )
    try:
        with Reader(folder) as reader:
            return _read(folder, reader, wanted)
    except (InputError, MemoryError):
        raise
    except Exception as err:  # a damaged file fails in as many ways as there are parsers
        reason = one_line(err) or type(err).__name__
        raise InputError(
            f"{folder}: bag is damaged or truncated ({reason}); copy it again or record anew"
        ) from err


def _read(folder: Path, reader: Reader, wanted: Collection[str]) -> Bag:
    listed: dict[str, str] = {}
    for connection in reader.connections:
        if listed.setdefault(connection.topic, connection.msgtype) != connection.msgtype:
            raise InputError(
                f"{folder}: {connection.topic}: recorded with two message types; keep one publisher"
            )
    collector = _Collector()
    chosen = [connection for connection in reader.connections if connection.topic in wanted]
    _collect(reader, chosen, collector)
    _check_complete(folder, reader, chosen, collector)
    return Bag(
        folder, listed, {name: collector.topic(name, listed[name]) for name in listed if name in wanted}
    )


def _check_complete(folder: Path, reader: Reader, chosen: list[Connection], collector: _Collector) -> None:
    """A file that was cut off may still open: metadata.yaml tells how much it held."""
    for name in {connection.topic for connection in chosen}:
        promised = sum(connection.msgcount for connection in chosen if connection.topic == name)
        if collector.counts[name] < promised:
            raise InputError(
                f"{folder}: {name}: {collector.counts[name]} messages of the {promised} in metadata.yaml; "
                "the bag is truncated: copy it again or run 'ros2 bag reindex'"
            )


def _collect(reader: Reader, chosen: list[Connection], collector: _Collector) -> None:
    directory = reader.storage
    assert isinstance(directory, DirectoryReader)
    topics = {connection.topic for connection in chosen}
    unpack = zstd.decompress if reader.compression_mode == "message" else None
    for storage in directory.storages:
        names = {
            connection.id: connection.topic
            for connection in storage.connections
            if connection.topic in topics
        }
        if isinstance(storage, Sqlite3Reader):
            _collect_sqlite3(Path(str(storage.path)), names, unpack, collector)
        elif isinstance(storage, McapReader):
            with Path(str(storage.path)).open("rb") as file:
                _collect_mcap(file, names, unpack, collector)
        else:
            raise InputError(
                f"{directory.path}: storage {type(storage).__name__} is not read; convert the bag to mcap"
            )


def _collect_sqlite3(
    path: Path, names: dict[int, str], unpack: Callable[[bytes], bytes] | None, collector: _Collector
) -> None:
    connection = sqlite3.connect(f"{path.absolute().as_uri()}?immutable=1", uri=True)
    try:
        cursor = connection.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
        while rows := cursor.fetchmany(_ROWS_AT_ONCE):
            by_topic: dict[int, tuple[list[int], list[bytes]]] = {number: ([], []) for number in names}
            for number, received, data in rows:
                if number in by_topic:
                    times, messages = by_topic[number]
                    times.append(received)
                    messages.append(data)
            for number, (times, messages) in by_topic.items():
                if messages:
                    collector.add(names[number], times, list(map(unpack, messages)) if unpack else messages)
    finally:
        connection.close()


def _collect_mcap(
    file: BinaryIO, names: dict[int, str], unpack: Callable[[bytes], bytes] | None, collector: _Collector
) -> None:
    for buffer in _mcap_buffers(file):
        array = np.frombuffer(buffer, np.uint8)
        for number, (times, starts, ends) in _mcap_messages(buffer, names).items():
            if not times:
                continue
            if unpack:
                messages = [unpack(buffer[start:end]) for start, end in zip(starts, ends, strict=True)]
                collector.add(names[number], times, messages)
            else:
                collector.add_slices(names[number], times, array, starts, ends)


def _mcap_messages(buffer: bytes, names: dict[int, str]) -> dict[int, tuple[list[int], list[int], list[int]]]:
    """Receive times, starts and ends of the messages in ``buffer``, by channel."""
    found: dict[int, tuple[list[int], list[int], list[int]]] = {number: ([], [], []) for number in names}
    position, end = 0, len(buffer)
    unpack_message, size = _MESSAGE.unpack_from, _MESSAGE.size
    while position + size <= end:
        opcode, length, channel, _, received, _ = unpack_message(buffer, position)
        following = position + _RECORD.size + length
        if opcode == _MCAP_MESSAGE and channel in found:
            times, starts, ends = found[channel]
            times.append(received)
            starts.append(position + size)
            ends.append(following)
        position = following
    if position > end:
        raise ValueError(f"an mcap record of {length} bytes runs past the end of its chunk")
    return found


def _mcap_buffers(file: BinaryIO) -> Iterator[bytes]:
    """Runs of records that hold messages: each chunk decompressed, and messages outside of chunks.

    Layout: https://mcap.dev/spec, sections "Records" and "Chunk".
    """
    file.seek(8)
    loose = bytearray()
    while len(head := file.read(_RECORD.size)) == _RECORD.size:
        opcode, length = _RECORD.unpack(head)
        if opcode == _MCAP_DATA_END:
            break
        if opcode not in (_MCAP_CHUNK, _MCAP_MESSAGE):
            file.seek(length, 1)
            continue
        body = file.read(length)
        if len(body) != length:
            raise ValueError(f"an mcap record of {length} bytes ends after {len(body)}")
        if opcode == _MCAP_CHUNK:
            yield _decompressed(body)
        else:
            loose += head + body
            if len(loose) > 1 << 22:
                yield bytes(loose)
                loose.clear()
    yield bytes(loose)


def _decompressed(chunk: bytes) -> bytes:
    _, _, size, checksum, name_length = _CHUNK.unpack_from(chunk)
    name = chunk[_CHUNK.size : _CHUNK.size + name_length]
    records = chunk[_CHUNK.size + name_length + 8 :]  # behind the length of the records
    if name == b"zstd":
        records = zstd.decompress(records)
    elif name == b"lz4":
        records = lz4.frame.decompress(records)
    elif name:
        raise ValueError(f"mcap chunk compression {name.decode(errors='replace')} is unknown")
    if len(records) != size:
        raise ValueError(f"an mcap chunk holds {len(records)} bytes instead of {size}")
    if checksum and crc32(records) != checksum:
        raise ValueError("an mcap chunk does not match its checksum")
    return records
