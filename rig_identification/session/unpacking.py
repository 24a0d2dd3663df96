"""Compressed data unpacked within a limit, whole or as far as they go.

A damaged or hostile file claims any size. Recorders pack messages at most a few hundred to one: each message
carries a new stamp, which costs a byte or more of its few hundred. Beyond that, and :data:`_ALWAYS` bytes for
pictures of one colour, a claim is taken for damage. Memory and time so stay in proportion to the file.
"""

from __future__ import annotations

import bz2
import sys
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO, Protocol

import lz4.frame  # type: ignore[import-untyped]

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_ALWAYS = 1 << 28  # bytes that any file may unpack to, and the most of one piece: recorders' take a few MiB
_LARGEST_RATIO = 300
#: Bytes of one message that was packed by itself: a JointState of a thousand joints.
_LARGEST_MESSAGE = 1 << 16
#: Messages that any piece may hold, whatever it was packed to. Each further one carries a stamp that nothing
#: before it foretells, so it took a byte of the packed piece at least.
_FEW = 1 << 16
_AT_ONCE = 1 << 20


class Damaged(ValueError):
    """Bytes that are not what they say."""


class _Decompressor(Protocol):
    @property
    def eof(self) -> bool: ...
    @property
    def needs_input(self) -> bool: ...
    @property
    def unused_data(self) -> bytes | None: ...
    def decompress(self, data: bytes, max_length: int = -1) -> bytes: ...


_DECOMPRESSORS: dict[str, Callable[[], _Decompressor]] = {
    "zstd": zstd.ZstdDecompressor,
    "lz4": lz4.frame.LZ4FrameDecompressor,
    "bz2": bz2.BZ2Decompressor,
}


def most_unpacked(packed: int) -> int:
    """Bytes that a file of ``packed`` bytes may unpack to, all of its pieces together."""
    return _ALWAYS + _LARGEST_RATIO * packed


def most_records(packed: int) -> int:
    """Records that a piece of ``packed`` bytes may hold."""
    return _FEW + packed


class Allowance:
    """What the pieces of one file of ``packed`` bytes may still unpack to."""

    def __init__(self, packed: int) -> None:
        self._left = most_unpacked(packed)

    def take(self, size: int) -> None:
        """Count ``size`` bytes. Raises Damaged where they are more than is left."""
        if size > self._left:
            raise Damaged("its pieces claim to hold more than such a file can")
        self._left -= size


def unpacked(compression: str, data: bytes, size: int) -> bytes:
    """The ``size`` bytes that ``data`` unpack to, fewer where ``data`` end early.

    Raises
    ------
    Damaged
        An unknown compression, bytes that are not of it, or a size beyond the limit.
    """
    if size > min(_ALWAYS, most_unpacked(len(data))):
        raise Damaged(f"{len(data)} bytes claim to hold {size}")
    if compression not in _DECOMPRESSORS:
        raise Damaged(f"compression {compression} is unknown")
    out = b""
    while data and len(out) <= size:
        decompressor = _DECOMPRESSORS[compression]()
        try:
            piece = decompressor.decompress(data, size + 1 - len(out))
        except (zstd.ZstdError, RuntimeError, OSError) as err:
            raise Damaged(f"no {compression} data") from err
        out = piece if not out else out + piece
        data = (decompressor.unused_data or b"") if decompressor.eof else b""
    return out


def unpacked_message(data: bytes) -> bytes:
    """One message that was packed by itself. Raises Damaged."""
    decompressor: _Decompressor = zstd.ZstdDecompressor()
    try:
        message = decompressor.decompress(data, _LARGEST_MESSAGE + 1)
    except zstd.ZstdError as err:
        raise Damaged("a compressed message does not unpack") from err
    if len(message) > _LARGEST_MESSAGE:
        raise Damaged(f"a compressed message of {len(data)} bytes holds more than {_LARGEST_MESSAGE}")
    if not decompressor.eof:
        raise Damaged("a compressed message is cut off")
    return message


def unpack_file(source: BinaryIO, size: int, target: Path) -> bool:
    """Unpack a zstd file of ``size`` bytes to ``target``; whether it was whole.

    Raises
    ------
    Damaged
        Bytes that are no zstd, or more than the limit. What came before them may be wrong as well: a frame's
        checksum stands at its end.
    """
    left = most_unpacked(size)
    decompressor: _Decompressor = zstd.ZstdDecompressor()
    with target.open("wb") as out:
        while data := source.read(_AT_ONCE):
            # A few bytes may stand for gigabytes: they are taken out piece by piece
            while data or not (decompressor.eof or decompressor.needs_input):
                if decompressor.eof:
                    decompressor = zstd.ZstdDecompressor()
                try:
                    piece = decompressor.decompress(data, _AT_ONCE)
                except zstd.ZstdError as err:
                    raise Damaged("compressed data do not unpack") from err
                data = (decompressor.unused_data or b"") if decompressor.eof else b""
                left -= len(piece)
                if left < 0:
                    raise Damaged(f"{size} bytes claim to hold more than {most_unpacked(size)}")
                out.write(piece)
    return decompressor.eof
