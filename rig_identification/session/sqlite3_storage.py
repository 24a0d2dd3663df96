"""Messages of a sqlite3 file, as far as its pages are there; nothing is written to it or beside it."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import numpy as np

from rig_identification.session.contents import Contents
from rig_identification.session.sqlite3_pages import (
    Rows,
    UnknownLayout,
    is_cut_off,
    pages_of,
    rows_from_pages,
    size_by_header,
    table_at,
)
from rig_identification.session.sqlite3_pieces import scattered_rows

MAGIC = b"SQLite format 3\x00"
_ROWS_AT_ONCE = 20_000
_COLUMNS = ("id", "topic_id", "timestamp", "data")
#: Files beside the database that hold what a recorder wrote last, if it was not closed.
_LOGS = ("-wal", "-journal")


def collect_sqlite3(path: Path, contents: Contents) -> list[str]:
    """Add what the file holds to ``contents``.

    Returns
    -------
    list of str
        What is to be said of the file, each a sentence without its subject, the file.

    Raises
    ------
    InputError
        A topic of two types, or messages of an encoding that is not read.
    sqlite3.DatabaseError
        A file that is not cut off and holds a page that is none: its other pages may be wrong as well, for
        they carry no checksum.
    """
    with _settled(path) as (file, notes):
        cut, size, whole = is_cut_off(file), file.stat().st_size, size_by_header(file)
        if cut:
            notes.append(f"is truncated: what is in the {size} bytes that are there was read (of {whole})")
        try:
            names = _topics(file, contents)
            if cut:
                _collect_pieces(file, names, contents)
            elif not _collect(file, names, contents):
                notes.append("is truncated: pages of it were never written; what is in the others was read")
        except (sqlite3.DatabaseError, UnknownLayout):
            if not cut:
                raise
    return notes


@contextmanager
def _settled(path: Path) -> Iterator[tuple[Path, list[str]]]:
    """The database, or where its recorder left a log of its last changes a copy with these in it."""
    logs = [log for end in _LOGS if (log := Path(f"{path}{end}")).is_file() and log.stat().st_size]
    if not logs:
        yield path, []
        return
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / path.name
        for file in (path, *logs):
            shutil.copyfile(file, Path(scratch) / file.name)
        with suppress(sqlite3.DatabaseError), closing(sqlite3.connect(copy)) as database:
            database.execute("SELECT count(*) FROM sqlite_master").fetchall()
            database.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
        yield copy, [f"was not closed by its recorder: read with {', '.join(log.name for log in logs)}"]


@contextmanager
def _opened(path: Path) -> Iterator[sqlite3.Connection]:
    """The database, read-only and without a lock."""
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?immutable=1", uri=True)) as database:
        # Otherwise a file that is shorter than it says is not opened at all.
        database.execute("PRAGMA writable_schema = ON")
        yield database


def _topics(path: Path, contents: Contents) -> dict[int, str]:
    """Topic id -> name; ``contents`` meets each."""
    names: dict[int, str] = {}
    with _opened(path) as database:
        rows = database.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
    for number, name, message_type, encoding in rows:
        contents.meet(str(name), str(message_type), str(encoding))
        names[number] = str(name)
    return names


def _collect(path: Path, names: dict[int, str], contents: Contents) -> bool:
    """Add all messages; whether every page of theirs is there. Raises sqlite3.DatabaseError."""
    done = 0
    try:
        table = table_at(path, _root_page(path))
        if not table.whole:
            _collect_pieces(path, names, contents)
            return False
        for rows in rows_from_pages(table):
            _add_rows(rows, names, contents)
            done += len(rows.topic_id)
        return True
    except UnknownLayout:
        pass
    for number, times, messages in rows_from_query(path, names, skip=done):
        if contents.wants(names[number]):
            contents.add(names[number], times, messages)
        else:
            contents.count(names[number], len(times))
    return True


def _collect_pieces(path: Path, names: dict[int, str], contents: Contents) -> None:
    """Add the messages of every page that is there. Raises UnknownLayout."""
    for rows in scattered_rows(pages_of(path)):
        for number in {row.topic_id for row in rows} & names.keys():
            chosen = [row for row in rows if row.topic_id == number]
            if contents.wants(names[number]):
                times = [row.received_ns for row in chosen]
                contents.add(names[number], times, [row.data for row in chosen])
            else:
                contents.count(names[number], len(chosen))


def _add_rows(rows: Rows, names: dict[int, str], contents: Contents) -> None:
    for number, name in names.items():
        chosen = np.flatnonzero(rows.topic_id == number)
        if len(chosen) and contents.wants(name):
            received, starts, ends = rows.received_ns[chosen], rows.starts[chosen], rows.ends[chosen]
            contents.add_slices(name, received, rows.buffer, starts, ends)
        else:
            contents.count(name, len(chosen))


def _root_page(path: Path) -> int:
    """First page of the table of messages. Raises UnknownLayout."""
    query = "SELECT rootpage FROM sqlite_master WHERE type = 'table' AND name = 'messages'"
    try:
        with _opened(path) as database:
            columns = database.execute("PRAGMA table_info(messages)").fetchall()
            found = database.execute(query).fetchone()
    except sqlite3.DatabaseError as err:
        raise UnknownLayout("no schema") from err
    # An INTEGER PRIMARY KEY is the row's key and is stored as NULL in the row.
    if tuple(column[1] for column in columns) != _COLUMNS or columns[0][2:6:3] != ("INTEGER", 1) or not found:
        raise UnknownLayout("another table")
    return int(found[0])


def rows_from_query(
    path: Path, topic_ids: Collection[int], *, skip: int = 0
) -> Iterator[tuple[int, list[int], list[bytes]]]:
    """Topic id, receive times and messages of the topics ``topic_ids`` after ``skip`` rows.

    Raises
    ------
    sqlite3.DatabaseError
        A page that is missing or none; what came before it has been handed on.
    """
    query = "SELECT topic_id, timestamp, data FROM messages ORDER BY id LIMIT -1 OFFSET ?"
    with _opened(path) as database:
        cursor = database.execute(query, (skip,))
        failure: sqlite3.DatabaseError | None = None
        while failure is None:
            rows = []
            try:
                for row in cursor:
                    rows.append(row)
                    if len(rows) == _ROWS_AT_ONCE:
                        break
            except sqlite3.DatabaseError as err:
                failure = err
            for topic_id in topic_ids:
                chosen = [row for row in rows if row[0] == topic_id]
                yield topic_id, [row[1] for row in chosen], [row[2] for row in chosen]
            if not rows:
                break
        if failure is not None:
            raise failure
