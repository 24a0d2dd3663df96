"""Messages of an mcap file, from its beginning to its end or to where it was cut off; no index is needed.

Layout: https://mcap.dev/spec, sections "Records", "Chunk" and "Message".
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

import numpy as np

from rig_identification.session.contents import Contents
from rig_identification.session.file_end import written_size
from rig_identification.session.unpacking import Allowance, Damaged, most_records, unpacked

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F
_RECORD = struct.Struct("<BQ")  # opcode, length
_MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, uncompressed size, crc, length of the compression's name
_LOOSE_AT_ONCE = 1 << 22


def collect_mcap(path: Path, contents: Contents) -> list[str]:
    """Add what the file holds to ``contents``.

    Returns
    -------
    list of str
        What is to be said of the file, each a sentence without its subject, the file.

    Raises
    ------
    InputError
        A topic of two types, or messages of an encoding that is not read.
    """
    size = written_size(path)
    reading = _Reading(contents, Allowance(size))
    with path.open("rb") as file:
        file.seek(len(MAGIC))
        for buffer, whole, most in reading.buffers(file, size):
            try:
                reading.take(buffer, whole, most)
            except Damaged as err:
                reading.damage.append(str(err))
    return reading.notes()


class _Reading:
    """One pass over one file."""

    def __init__(self, contents: Contents, allowance: Allowance) -> None:
        self._contents = contents
        self._allowance = allowance
        self._types: dict[int, str] = {}  # schema id -> message type
        self._topics: dict[int, str] = {}  # channel id -> topic
        self._kept: set[int] = set()  # channel ids whose messages are wanted
        self._chunks = 0
        self._cut_at: int | None = None  # byte at which the file stops being records
        self._data_end = self._closed = self._indexed = False
        self._undescribed = 0  # messages of channels that the file does not describe
        self.damage: list[str] = []  # what is wrong with each chunk that is left out

    def notes(self) -> list[str]:
        """What is to be said of the file."""
        notes = []
        if self._cut_at is not None and not self._data_end:
            notes.append(
                f"is truncated: it ends without its closing record; every whole message of its first "
                f"{self._cut_at} bytes was read"
            )
        elif not self._closed:
            notes.append("has no end, for its index is cut off: all its messages were read")
        elif not self._indexed:
            notes.append("has no index: it was read from beginning to end")
        if self.damage:
            notes.append(
                f"is damaged: {len(self.damage)} of {self._chunks} chunks are left out ({self.damage[0]})"
            )
        if self._undescribed:
            notes.append(f"holds {self._undescribed} messages of no described topic: left out")
        return notes

    def buffers(self, file: BinaryIO, size: int) -> Iterator[tuple[bytes, bool, int]]:
        """Runs of records: chunks unpacked, and records outside of chunks.

        Each with whether it is whole, and with how many records it may hold.
        """
        loose = bytearray()
        for opcode, length, body in self._records(file, size):
            if opcode == _CHUNK:
                if loose:
                    yield bytes(loose), True, len(loose)
                    loose.clear()
                self._chunks += 1
                try:
                    records = _records_of(body, length, self._allowance)
                except Damaged as err:
                    self.damage.append(str(err))
                    continue
                yield records, len(body) == length, most_records(length)
            elif len(body) == length:
                loose += _RECORD.pack(opcode, length) + body
                if len(loose) > _LOOSE_AT_ONCE:
                    yield bytes(loose), True, len(loose)
                    loose.clear()
        yield bytes(loose), True, len(loose)

    def _records(self, file: BinaryIO, size: int) -> Iterator[tuple[int, int, bytes]]:
        """Opcode, length and body of the records that tell of messages; the last body may be cut off."""
        while True:
            start = file.tell()
            head = file.read(_RECORD.size)
            opcode, length = (
                _RECORD.unpack(head) if len(head) == _RECORD.size else (0, 0)
            )  # no record has opcode 0
            left = size - start - _RECORD.size
            if opcode == 0 or length > left:
                self._cut_at = size if opcode else start
                if opcode in (_CHUNK, _MESSAGE):
                    yield opcode, length, file.read(max(left, 0))
                return
            if opcode in (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK):
                yield opcode, length, file.read(length)
                continue
            if opcode == _FOOTER:
                self._indexed = file.read(8) != bytes(8)
                self._closed = True
                return
            self._data_end |= opcode == _DATA_END
            file.seek(length, 1)

    def take(self, buffer: bytes, whole: bool, most: int) -> None:
        """Add the messages of a run of at most ``most`` records. Raises Damaged, InputError."""
        found: dict[int, tuple[list[int], list[int], list[int]]] = {
            channel: ([], [], []) for channel in self._kept
        }
        others: dict[int, int] = {}
        position, end = 0, len(buffer)
        unpack, size = _MESSAGE_HEAD.unpack_from, _MESSAGE_HEAD.size
        for _ in range(most):
            if position + size > end:
                break
            opcode, length, channel, _, received, _ = unpack(buffer, position)
            following = position + _RECORD.size + length
            if opcode == _MESSAGE and following <= end:
                if channel in found:
                    times, starts, ends = found[channel]
                    times.append(received)
                    starts.append(position + size)
                    ends.append(following)
                else:
                    others[channel] = others.get(channel, 0) + 1
            elif opcode in (_SCHEMA, _CHANNEL) and following <= end:
                self._describe(buffer, position, found)
            position = following
        else:
            if position + size <= end:
                raise Damaged(f"a chunk holds more than {most} records")
        while position + _RECORD.size <= end:  # short ones at the end
            length = int.from_bytes(buffer[position + 1 : position + _RECORD.size], "little")
            following = position + _RECORD.size + length
            if following <= end:
                self._describe(buffer, position, found)
            position = following
        if whole and position != end:
            raise Damaged("a record runs past the end of its chunk")
        self._add(buffer, found, others)

    def _describe(
        self, buffer: bytes, position: int, found: dict[int, tuple[list[int], list[int], list[int]]]
    ) -> None:
        """Take a schema's or a channel's record."""
        opcode, length = _RECORD.unpack_from(buffer, position)
        body = buffer[position + _RECORD.size : position + _RECORD.size + length]
        try:
            if opcode == _SCHEMA:
                self._types[int.from_bytes(body[:2], "little")] = _string(body, 2)[0]
            elif opcode == _CHANNEL:
                channel, schema = struct.unpack_from("<HH", body)
                topic, behind = _string(body, 4)
                self._contents.meet(topic, self._types.get(schema, ""), _string(body, behind)[0])
                self._topics[channel] = topic
                if self._contents.wants(topic):
                    self._kept.add(channel)
                    found.setdefault(channel, ([], [], []))
                else:
                    self._kept.discard(channel)
        except (struct.error, UnicodeDecodeError) as err:
            raise Damaged("a topic's description is no text") from err

    def _add(
        self,
        buffer: bytes,
        found: dict[int, tuple[list[int], list[int], list[int]]],
        others: dict[int, int],
    ) -> None:
        array = np.frombuffer(buffer, np.uint8)
        for channel, (received, starts, ends) in found.items():
            if received:
                self._contents.add_slices(self._topics[channel], received, array, starts, ends)
        for channel, count in others.items():
            if channel in self._topics:
                self._contents.count(self._topics[channel], count)
            else:
                self._undescribed += count


def _string(body: bytes, at: int) -> tuple[str, int]:
    """Text with its length before it, and the place behind it."""
    (length,) = struct.unpack_from("<I", body, at)
    return body[at + 4 : at + 4 + length].decode(), at + 4 + length


def _records_of(chunk: bytes, length: int, allowance: Allowance) -> bytes:
    """Records of a chunk of ``length`` bytes, as many as ``chunk`` has of them. Raises Damaged."""
    if len(chunk) < _CHUNK_HEAD.size:
        return b""
    _, _, size, checksum, name_length = _CHUNK_HEAD.unpack_from(chunk)
    start = _CHUNK_HEAD.size + name_length + 8  # behind the length of the records
    name = chunk[_CHUNK_HEAD.size : start - 8].decode(errors="replace")
    packed = int.from_bytes(chunk[start - 8 : start], "little")
    if len(chunk) < start:
        return b""
    if start + packed != length:
        raise Damaged(f"a chunk of {length} bytes says that its records take {packed}")
    records = chunk[start:]
    if name:
        allowance.take(size)
        records = unpacked(name, records, size)
    if len(chunk) < length:
        return records[:size]
    if len(records) != size:
        raise Damaged(f"a chunk does not hold the {size} bytes it says")
    if checksum and crc32(records) != checksum:
        raise Damaged("a chunk does not match its checksum")
    return records
