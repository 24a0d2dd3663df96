"""Messages of a ROS 1 bag, from its beginning to its end or to where it was cut off; no index is needed.

Layout: https://wiki.ros.org/Bags/Format/2.0.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from rig_identification.session.contents import Contents
from rig_identification.session.file_end import written_size
from rig_identification.session.unpacking import Allowance, Damaged, most_records, unpacked

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 0x02, 0x03, 0x05, 0x07
_WORD = struct.Struct("<I")

_Record = tuple[dict[str, bytes], int, int]  # header, start and end of the data


def collect_rosbag1(path: Path, contents: Contents) -> list[str]:
    """Add what the file holds to ``contents``.

    Returns
    -------
    list of str
        What is to be said of the file, each a sentence without its subject, the file.

    Raises
    ------
    InputError
        A topic of two types, or a message that is none of its type.
    """
    size = written_size(path)
    reading = _Reading(contents, Allowance(size))
    with path.open("rb") as file:
        file.seek(len(MAGIC))
        cut_at = reading.run(file, size)
    notes = []
    if cut_at is not None:
        notes.append(f"is truncated: every whole message of its first {cut_at} bytes was read")
    elif not reading.indexed:
        notes.append("was not closed by its recorder: it was read from beginning to end")
    if reading.damage:
        notes.append(f"is damaged: parts of it left out: {len(reading.damage)} ({reading.damage[0]})")
    return notes


class _Reading:
    """One pass over one file."""

    def __init__(self, contents: Contents, allowance: Allowance) -> None:
        self._allowance = allowance
        self.indexed = False
        self.damage: list[str] = []  # what is wrong with each piece that is left out
        self._contents = contents
        self._topics: dict[int, str] = {}  # connection -> topic

    def run(self, file: BinaryIO, size: int) -> int | None:
        """Read all; the byte at which the file was cut off, None where it is whole."""
        while (start := file.tell()) < size:
            header = _header(_sized(file, size))
            if header is None:
                return start
            word = file.read(_WORD.size)
            length = _WORD.unpack(word)[0] if len(word) == _WORD.size else size
            data = file.read(min(length, size - file.tell()))
            try:
                self._record(header, data, whole=len(data) == length)
            except Damaged as err:
                self.damage.append(str(err))
            if len(data) < length:
                return size
        return None

    def _record(self, header: dict[str, bytes], data: bytes, whole: bool) -> None:
        kind = _number(header, "op")
        if kind == _BAG:
            self.indexed = _number(header, "index_pos") > 0
        elif kind == _CHUNK:
            self._take(_records_of(header, data, whole, self._allowance), most_records(len(data)))
        elif kind == _CONNECTION and whole:
            self._describe(header, _header(data) or {})
        elif kind == _MESSAGE and whole:
            self._add(header, [(_time(header), data)])

    def _take(self, records: bytes, most: int) -> None:
        """Messages of a chunk of at most ``most`` records."""
        found: dict[int, list[tuple[int, bytes]]] = defaultdict(list)
        for number, (header, start, end) in enumerate(_split(records)):
            if number == most:
                raise Damaged(f"a chunk holds more than {most} records")
            kind = _number(header, "op")
            if kind == _CONNECTION:
                self._describe(header, _header(records[start:end]) or {})
            elif kind == _MESSAGE:
                found[_number(header, "conn")].append((_time(header), records[start:end]))
        for connection, messages in found.items():
            self._add({"conn": _WORD.pack(connection)}, messages)

    def _describe(self, header: dict[str, bytes], description: dict[str, bytes]) -> None:
        topic = header.get("topic", b"").decode(errors="replace")
        message_type = description.get("type", b"").decode(errors="replace")
        name = "/" + "/".join(part for part in topic.split("/") if part)
        self._contents.meet(name, message_type, "ros1")
        self._topics[_number(header, "conn")] = name

    def _add(self, header: dict[str, bytes], messages: list[tuple[int, bytes]]) -> None:
        topic = self._topics.get(_number(header, "conn"))
        if topic is None:
            raise Damaged("messages of no described topic")
        if self._contents.wants(topic):
            self._contents.add(topic, [time for time, _ in messages], [data for _, data in messages])
        else:
            self._contents.count(topic, len(messages))


def _sized(file: BinaryIO, size: int) -> bytes | None:
    """Bytes with their number before them; None where the file ends first, or where there are none."""
    word = file.read(_WORD.size)
    length = _WORD.unpack(word)[0] if len(word) == _WORD.size else 0
    return file.read(length) if 0 < length <= size - file.tell() else None


def _header(data: bytes | None) -> dict[str, bytes] | None:
    """Fields ``name=value`` of a header; None where it is none."""
    if data is None:
        return None
    fields, position = {}, 0
    while position + _WORD.size <= len(data):
        (length,) = _WORD.unpack_from(data, position)
        name, equals, value = data[position + _WORD.size : position + _WORD.size + length].partition(b"=")
        if not equals:
            return None
        fields[name.decode(errors="replace")] = value
        position += _WORD.size + length
    return fields if position == len(data) else None


def _split(records: bytes) -> Iterator[_Record]:
    """Whole records that follow each other; the last one may be cut off. Raises Damaged."""
    position, end = 0, len(records)
    while position + _WORD.size <= end:
        start = position + _WORD.size
        behind = start + int.from_bytes(records[position:start], "little")
        data = behind + _WORD.size
        if data > end:
            return
        header = _header(records[start:behind])
        if header is None:
            raise Damaged("a record's header is none")
        position = data + int.from_bytes(records[behind:data], "little")
        if position <= end:
            yield header, data, position


def _records_of(header: dict[str, bytes], data: bytes, whole: bool, allowance: Allowance) -> bytes:
    """Records of a chunk, as many as ``data`` has of them. Raises Damaged."""
    compression, size = header.get("compression", b"").decode(errors="replace"), _number(header, "size")
    if compression == "none":
        records = data
    else:
        allowance.take(size)
        records = unpacked(compression, data, size)
    if whole and len(records) != size:
        raise Damaged(f"a chunk does not hold the {size} bytes it says")
    return records


def _number(header: dict[str, bytes], name: str) -> int:
    return int.from_bytes(header.get(name, b""), "little")


def _time(header: dict[str, bytes]) -> int:
    """ns."""
    value = header.get("time", bytes(8))
    return int.from_bytes(value[:4], "little") * 1_000_000_000 + int.from_bytes(value[4:8], "little")
