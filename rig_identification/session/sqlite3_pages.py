"""Rows of a sqlite3 bag, taken from the file's pages in bulk.

A query costs a Python object for each column of each message, more than all further work on it together.
The file format is simple and frozen, so the leaves of the table ``messages`` are read as arrays. Whatever
does not look as expected is left to a query.

Layout: https://www.sqlite.org/fileformat2.html, sections 1.3, 1.6 and 2.1.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig_identification.session.raw_topic import Bytes, Integers, by_value, slices

_PAGES_AT_ONCE = 512
_INTERIOR, LEAF = 0x05, 0x0D
_NEVER_WRITTEN = 0x00  # no page is of this kind: a file system that lost power fills a file with zeros
_DEEPEST = 20  # levels; 2^31 pages of 450 children take four
_COLUMNS = 4  # id, topic_id, timestamp, data
#: Bytes of an integer by its serial type; 0, 8 and 9 are NULL, 0 and 1 without bytes.
INTEGER_BYTES = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8, 8: 0, 9: 0}


class UnknownLayout(Exception):
    """The file is not laid out as the bulk reader expects."""


@dataclass(frozen=True)
class Rows:
    """Some rows of the table ``messages`` in order: message k is ``buffer[starts[k]:ends[k]]``."""

    topic_id: Integers
    received_ns: Integers
    buffer: Bytes
    starts: Integers
    ends: Integers


@dataclass(frozen=True)
class Table:
    """Leaf pages of one table, in the order of its keys."""

    pages: Bytes  # (count, size) of the file
    leaves: Integers  # indices of pages
    whole: bool  # False: some pages of the table are not there


def rows_from_pages(table: Table) -> Iterator[Rows]:
    """All rows by page.

    Raises
    ------
    UnknownLayout
        The next rows are laid out otherwise.
    """
    for start in range(0, len(table.leaves), _PAGES_AT_ONCE):
        chosen = table.leaves[start : start + _PAGES_AT_ONCE]
        try:
            rows = _rows(np.ascontiguousarray(table.pages[chosen]))
        except (IndexError, ValueError) as err:
            raise UnknownLayout("a place outside of its page") from err
        yield rows


def size_by_header(path: Path) -> int:
    """Bytes that the file has by its own account; 0 where it does not say."""
    header = np.fromfile(path, np.uint8, 100).tobytes()
    if len(header) < 100 or header[24:28] != header[92:96]:  # written by a version that kept no account
        return 0
    return int.from_bytes(header[28:32], "big") * _page_size(header)


def is_cut_off(path: Path) -> bool:
    """Whether the file is shorter than it says, or its last page was never written."""
    with path.open("rb") as file:
        size = _page_size(file.read(100))
        file.seek(-min(size, path.stat().st_size), os.SEEK_END)
        return path.stat().st_size < size_by_header(path) or not any(file.read(size))


def _page_size(header: bytes) -> int:
    size = int.from_bytes(header[16:18], "big")
    return 65536 if size == 1 else size


def pages_of(path: Path) -> Bytes:
    """(count, size) whole pages of the file. Raises UnknownLayout."""
    header = np.fromfile(path, np.uint8, 100).tobytes()
    size = _page_size(header)
    if len(header) < 100 or header[20] != 0 or size < 512:
        raise UnknownLayout("no header, or reserved bytes")
    return np.memmap(path, np.uint8, mode="r", shape=(path.stat().st_size // size, size))


def table_at(path: Path, root: int) -> Table:
    """The table whose tree begins at page ``root``, from the pages that are there. Raises UnknownLayout."""
    pages = pages_of(path)
    level, whole = np.array([root - 1]), True
    for _ in range(_DEEPEST):
        asked = len(level)
        level = level[(level >= 0) & (level < len(pages))]
        level = level[pages[level, 0] != _NEVER_WRITTEN]
        whole &= len(level) == asked
        kinds = pages[level, 0]
        if np.all(kinds == LEAF):
            return Table(pages, level, whole)
        if np.any(kinds != _INTERIOR) or len(level) > len(pages):
            break
        level = np.concatenate([_children(pages[index]) for index in level])
    raise UnknownLayout("no tree of pages")


def _children(page: Bytes) -> Integers:
    raw = page.tobytes()
    count = min(int.from_bytes(raw[3:5], "big"), (len(raw) - 12) // 2)
    cells = np.frombuffer(raw, ">u2", count, 12)
    places = [*cells.tolist(), 8]
    return np.array([int.from_bytes(raw[place : place + 4], "big") for place in places]) - 1


def _rows(pages: Bytes) -> Rows:
    """Rows of a run of leaf pages."""
    size = pages.shape[1]
    buffer = pages.reshape(-1)
    counts = _big_endian(pages[:, 3:5])
    places = np.arange(counts.max(initial=0))
    pointers = _big_endian(pages[:, 8 : 8 + 2 * len(places)].reshape(len(pages), len(places), 2))
    at = (pointers + size * np.arange(len(pages))[:, None])[places < counts[:, None]]
    payload, at = _varint(buffer, at)
    _, at = _varint(buffer, at)
    header, first = _varint(buffer, at)
    kinds = []
    for _ in range(_COLUMNS):
        kind, first = _varint(buffer, first)
        kinds.append(kind)
    if np.any(kinds[0] != 0) or np.any(kinds[3] < 12) or np.any(kinds[3] % 2):
        raise UnknownLayout("a row of other types")
    topic_id, data_at = _integer(buffer, at + header, kinds[1])
    received, data_at = _integer(buffer, data_at, kinds[2])
    ends = data_at + (kinds[3] - 12) // 2
    if np.any(payload > size - 35):
        raise UnknownLayout("a message on several pages")
    if np.any(ends != at + payload):
        raise UnknownLayout("a row that does not end where it says")
    return Rows(topic_id, received, buffer, data_at, ends)


def _big_endian(pairs: Bytes) -> Integers:
    return pairs[..., 0].astype(np.int64) << 8 | pairs[..., 1]


def _signed(digits: Bytes) -> Integers:
    """Integers of the big-endian two's complement ``digits`` (n, size)."""
    size = digits.shape[1]
    if size in (1, 2, 4, 8):
        return digits.view(f">i{size}")[:, 0].astype(np.int64)
    value = digits[:, 0].astype(np.int8).astype(np.int64)
    for place in range(1, size):
        value = value << 8 | digits[:, place]
    return value


def _varint(buffer: Bytes, at: Integers) -> tuple[Integers, Integers]:
    """Integers of variable length at ``at``, and the places behind them."""
    first = buffer[at]
    value = (first & 0x7F).astype(np.int64)
    behind = at + 1
    more = np.flatnonzero(first & 0x80)
    while len(more):
        following = buffer[behind[more]]
        value[more] = value[more] << 7 | (following & 0x7F)
        behind[more] += 1
        more = more[(following & 0x80) != 0]
    return value, behind


def _integer(buffer: Bytes, at: Integers, kinds: Integers) -> tuple[Integers, Integers]:
    """Integers of serial types ``kinds`` at ``at``, and the places behind them."""
    value, behind = np.empty(len(at), np.int64), at.copy()
    for kind, chosen in by_value(kinds):
        if kind not in INTEGER_BYTES:
            raise UnknownLayout("a number of another type")
        size = INTEGER_BYTES[kind]
        if size == 0:
            value[chosen] = kind - 8
            continue
        value[chosen] = _signed(slices(buffer, at[chosen], size))
        behind[chosen] += size
    return value, behind
