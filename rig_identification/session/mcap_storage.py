"""Messages of an mcap bag, chunk by chunk.

Layout: https://mcap.dev/spec, sections "Records", "Chunk" and "Message".
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO
from zlib import crc32

import lz4.frame  # type: ignore[import-untyped]
import numpy as np

from rig_identification.session.raw_topic import Collector

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

_MAGIC_BYTES = 8
_MESSAGE, _CHUNK, _DATA_END = 0x05, 0x06, 0x0F
_RECORD = struct.Struct("<BQ")  # opcode, length
_MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, uncompressed size, crc, length of the compression's name
_LOOSE_AT_ONCE = 1 << 22


def collect_mcap(path: Path, names: dict[int, str], collector: Collector) -> None:
    """Add the messages of the channels ``names`` (channel id to topic) to ``collector``.

    Raises
    ------
    ValueError
        A record that is cut off, or a chunk that does not hold what it says.
    """
    with path.open("rb") as file:
        for buffer in _buffers(file):
            array = np.frombuffer(buffer, np.uint8)
            for channel, (received, starts, ends) in _messages(buffer, names).items():
                if received:
                    collector.add_slices(names[channel], received, array, starts, ends)


def _messages(buffer: bytes, names: dict[int, str]) -> dict[int, tuple[list[int], list[int], list[int]]]:
    """Receive times, starts and ends of the messages in ``buffer``, by channel."""
    found: dict[int, tuple[list[int], list[int], list[int]]] = {channel: ([], [], []) for channel in names}
    position, end = 0, len(buffer)
    unpack, size = _MESSAGE_HEAD.unpack_from, _MESSAGE_HEAD.size
    while position + size <= end:
        opcode, length, channel, _, received, _ = unpack(buffer, position)
        following = position + _RECORD.size + length
        if opcode == _MESSAGE and channel in found:
            times, starts, ends = found[channel]
            times.append(received)
            starts.append(position + size)
            ends.append(following)
        position = following
    if position > end:
        raise ValueError(f"an mcap record of {length} bytes runs past the end of its chunk")
    return found


def _buffers(file: BinaryIO) -> Iterator[bytes]:
    """Runs of records that hold messages: each chunk decompressed, and messages outside of chunks."""
    file.seek(_MAGIC_BYTES)
    loose = bytearray()
    while len(head := file.read(_RECORD.size)) == _RECORD.size:
        opcode, length = _RECORD.unpack(head)
        if opcode == _DATA_END:
            break
        if opcode not in (_CHUNK, _MESSAGE):
            file.seek(length, 1)
            continue
        body = file.read(length)
        if len(body) != length:
            raise ValueError(f"an mcap record of {length} bytes ends after {len(body)}")
        if opcode == _CHUNK:
            yield _decompressed(body)
            continue
        loose += head + body
        if len(loose) > _LOOSE_AT_ONCE:
            yield bytes(loose)
            loose.clear()
    yield bytes(loose)


def _decompressed(chunk: bytes) -> bytes:
    _, _, size, checksum, name_length = _CHUNK_HEAD.unpack_from(chunk)
    name = chunk[_CHUNK_HEAD.size : _CHUNK_HEAD.size + name_length]
    records = chunk[_CHUNK_HEAD.size + name_length + 8 :]  # behind the length of the records
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
