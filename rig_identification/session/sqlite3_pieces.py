"""Rows of a sqlite3 file whose pages are not all there, one by one.

The tree that leads to a table's leaves may stand on pages that are lost, so every leaf page of the file is
looked at by itself. Rows of the table of messages are known by their types.

Layout: https://www.sqlite.org/fileformat2.html, sections 1.6 and 2.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig_identification.session.raw_topic import Bytes
from rig_identification.session.sqlite3_pages import INTEGER_BYTES, LEAF


@dataclass(frozen=True)
class Row:
    """One row of the table of messages."""

    number: int  # rises in the order of writing
    topic_id: int
    received_ns: int
    data: bytes


def scattered_rows(pages: Bytes) -> list[list[Row]]:
    """Rows of each leaf page of messages by rising number; rows that are not whole are left out.

    pages: (count, size) of the file.
    """
    leaves = (np.flatnonzero(pages[1:, 0] == LEAF) + 1).tolist()  # the first page holds the schema
    found = [rows for index in leaves if (rows := _rows_of_page(pages, index))]
    return sorted(found, key=lambda rows: rows[0].number)


def _rows_of_page(pages: Bytes, index: int) -> list[Row]:
    page = pages[index].tobytes()
    count = min(int.from_bytes(page[3:5], "big"), (len(page) - 8) // 2)
    rows = []
    for k in range(count):
        place = int.from_bytes(page[8 + 2 * k : 10 + 2 * k], "big")
        try:
            row = _row(pages, page, place)
        except IndexError:  # runs out of the page
            continue
        if row is not None:
            rows.append(row)
    return rows


def _row(pages: Bytes, page: bytes, place: int) -> Row | None:
    """The row at ``place``; None where it is none of a message. Raises IndexError."""
    payload, at = _varint(page, place)
    number, at = _varint(page, at)
    header, behind = _varint(page, at)
    kinds = []
    while behind < at + header:
        kind, behind = _varint(page, behind)
        kinds.append(kind)
    if len(kinds) != 4 or kinds[0] != 0 or kinds[3] < 12 or kinds[3] % 2:
        return None
    if kinds[1] not in INTEGER_BYTES or kinds[2] not in INTEGER_BYTES:
        return None
    record = _payload(pages, page, at, payload)
    topic_id, behind = _integer(record, header, kinds[1])
    received, behind = _integer(record, behind, kinds[2])
    if len(record) != payload or behind + (kinds[3] - 12) // 2 != payload:
        return None
    return Row(number, topic_id, received, record[behind:])


def _payload(pages: Bytes, page: bytes, at: int, size: int) -> bytes:
    """A row's bytes, gathered from the pages that it runs over; fewer where one of them is lost."""
    most = len(page) - 35
    if size <= most:
        return page[at : at + size]
    least = (len(page) - 12) * 32 // 255 - 23
    local = least + (size - least) % (len(page) - 4)
    local = local if local <= most else least
    gathered, following = page[at : at + local], page[at + local : at + local + 4]
    while len(gathered) < size and 0 < (number := int.from_bytes(following, "big")) <= len(pages):
        overflow = pages[number - 1].tobytes()
        gathered, following = gathered + overflow[4 : 4 + size - len(gathered)], overflow[:4]
    return gathered


def _integer(record: bytes, at: int, kind: int) -> tuple[int, int]:
    size = INTEGER_BYTES[kind]
    if size == 0:
        return kind - 8, at
    return int.from_bytes(record[at : at + size], "big", signed=True), at + size


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Integer of variable length, and the place behind it. Raises IndexError."""
    value = 0
    for k in range(at, at + 9):
        value = value << 7 | (data[k] & 0x7F)
        if not data[k] & 0x80:
            return value, k + 1
    return value, at + 9
