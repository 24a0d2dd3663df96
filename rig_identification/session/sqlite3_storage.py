"""Messages of a sqlite3 bag, taken from the file's pages in bulk.

A query costs a Python object for each column of each message, more than all further work on it together.
The file format is simple and frozen, so the leaves of the table ``messages`` are read as arrays. Whatever
does not look as expected is left to a query.

Layout: https://www.sqlite.org/fileformat2.html, sections 1.3, 1.6 and 2.1.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rosbags.interfaces import Connection, ConnectionExtRosbag2, MessageDefinition, MessageDefinitionFormat
from rosbags.rosbag2.metadata import ReaderMetadata

from rig_identification.session.raw_topic import Bytes, Collector, Integers, distinct, slices

_PAGES_AT_ONCE = 512
_ROWS_AT_ONCE = 20_000
_INTERIOR, _LEAF = 0x05, 0x0D
_COLUMNS = ("id", "topic_id", "timestamp", "data")
#: Bytes of an integer by its serial type; 0, 8 and 9 are NULL, 0 and 1 without bytes.
_INTEGER_BYTES = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8, 8: 0, 9: 0}


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


class Sqlite3Topics:
    """Storage for rosbags' reader of folders: knows its topics, leaves the messages alone."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.connections: list[Connection] = []
        self.metadata = ReaderMetadata(0, 2**63 - 1, 0, 0, None, None, None, None)

    def open(self) -> None:
        """Read the list of topics."""
        undefined = MessageDefinition(MessageDefinitionFormat.NONE, "")
        with closing(_connect(self.path)) as connection:
            for number, name, message_type in connection.execute("SELECT id, name, type FROM topics"):
                cdr = ConnectionExtRosbag2("cdr", [])
                self.connections.append(Connection(number, name, message_type, undefined, "", 0, cdr, self))

    def close(self) -> None:
        """Nothing is held open."""

    def messages(self, *_: object) -> Iterator[tuple[Connection, int, bytes]]:
        """No messages: :func:`collect_sqlite3` takes them."""
        return iter(())


def collect_sqlite3(path: Path, names: dict[int, str], collector: Collector) -> None:
    """Add the messages of the topics ``names`` (topic id to name) to ``collector``."""
    done = 0
    try:
        for rows in rows_from_pages(path):
            for number, name in names.items():
                chosen = np.flatnonzero(rows.topic_id == number)
                if len(chosen):
                    received, starts, ends = rows.received_ns[chosen], rows.starts[chosen], rows.ends[chosen]
                    collector.add_slices(name, received, rows.buffer, starts, ends)
            done += len(rows.topic_id)
    except UnknownLayout:
        for number, times, messages in rows_from_query(path, names, skip=done):
            if messages:
                collector.add(names[number], times, messages)


def _connect(path: Path) -> sqlite3.Connection:
    """The database, read-only and without a lock."""
    return sqlite3.connect(f"{path.absolute().as_uri()}?immutable=1", uri=True)


def rows_from_pages(path: Path) -> Iterator[Rows]:
    """All rows by page.

    Raises
    ------
    UnknownLayout
        The file, the table or the next rows are laid out otherwise.
    """
    pages = _pages(path)
    leaves = _leaves(pages, _root_page(path))
    for start in range(0, len(leaves), _PAGES_AT_ONCE):
        yield _rows(np.ascontiguousarray(pages[leaves[start : start + _PAGES_AT_ONCE]]))


def rows_from_query(
    path: Path, topic_ids: Collection[int], *, skip: int = 0
) -> Iterator[tuple[int, list[int], list[bytes]]]:
    """Topic id, receive times and messages of the topics ``topic_ids`` after ``skip`` rows."""
    query = "SELECT topic_id, timestamp, data FROM messages ORDER BY id LIMIT -1 OFFSET ?"
    with closing(_connect(path)) as connection:
        cursor = connection.execute(query, (skip,))
        while rows := cursor.fetchmany(_ROWS_AT_ONCE):
            for topic_id in topic_ids:
                chosen = [row for row in rows if row[0] == topic_id]
                yield topic_id, [row[1] for row in chosen], [row[2] for row in chosen]


def _pages(path: Path) -> Bytes:
    """(count, size) pages of the file."""
    header = np.fromfile(path, np.uint8, 100)
    if len(header) < 100 or bytes(header[:16]) != b"SQLite format 3\x00":
        raise UnknownLayout("no SQLite 3 header")
    size = int.from_bytes(header[16:18].tobytes(), "big")
    size = 65536 if size == 1 else size
    length = path.stat().st_size
    if header[20] != 0 or size < 512 or length % size or Path(f"{path}-wal").exists():
        raise UnknownLayout("reserved bytes, a page cut off or a write-ahead log")
    return np.memmap(path, np.uint8, mode="r", shape=(length // size, size))


def _root_page(path: Path) -> int:
    with closing(_connect(path)) as connection:
        columns = connection.execute("PRAGMA table_info(messages)").fetchall()
        query = "SELECT rootpage FROM sqlite_master WHERE type = 'table' AND name = 'messages'"
        found = connection.execute(query).fetchone()
    # An INTEGER PRIMARY KEY is the row's key and is stored as NULL in the row.
    if tuple(column[1] for column in columns) != _COLUMNS or columns[0][2:6:3] != ("INTEGER", 1) or not found:
        raise UnknownLayout("another table")
    return int(found[0])


def _leaves(pages: Bytes, root: int) -> Integers:
    """Indices of the table's leaf pages in the order of its keys."""
    level = np.array([root - 1])
    while True:
        if level.min() < 0 or level.max() >= len(pages):
            raise UnknownLayout("a page beyond the end of the file")
        kinds = pages[level, 0]
        if np.all(kinds == _LEAF):
            return level
        if not np.all(kinds == _INTERIOR):
            raise UnknownLayout("a page of another kind")
        level = np.concatenate([_children(pages[index]) for index in level])


def _children(page: Bytes) -> Integers:
    raw = page.tobytes()
    count = int.from_bytes(raw[3:5], "big")
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
    for _ in _COLUMNS:
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
    for kind in distinct(kinds):
        if kind not in _INTEGER_BYTES:
            raise UnknownLayout("a number of another type")
        size = _INTEGER_BYTES[kind]
        chosen = slice(None) if np.all(kinds == kind) else np.flatnonzero(kinds == kind)
        if size == 0:
            value[chosen] = kind - 8
            continue
        value[chosen] = _signed(slices(buffer, at[chosen], size))
        behind[chosen] += size
    return value, behind
