"""Descriptions and bags that are made to cost much: aliases, nesting, compression, topics."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Callable
from pathlib import Path

from rig_identification.session.unpacking import zstd

#: What a session needs beside what is hostile in it.
RIG = """/**:
  ros__parameters:
    gravity: 9.80665
    cables: [left, right]
    left: {ceiling_point: [0, 0, 2], body_point: [0, 0, 0.1], length: 1.9}
    right: {ceiling_point: [1, 0, 2], body_point: [1, 0, 0.1], length: 1.9}
"""
WANTED = "/rig/left/wrench"
IDLE = 1 << 28  # bytes that every compressed piece is allowed


def laughs(levels: int) -> str:
    """Each line names the one before it ten times."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, levels)]
    return "\n".join(lines) + f"\nrig: *a{levels - 1}\nrecordings: *a{levels - 1}\n"


def merges(levels: int) -> str:
    """Each mapping takes in the one before it four times."""
    lines = ["a0: &a0 {k: 1}"]
    lines += [f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 4)}], k{i}: 2}}" for i in range(1, levels)]
    return "\n".join(lines) + "\n"


#: Name -> text of a description.
TEXTS = {
    "aliases of aliases": laughs(12),
    "merges of merges": merges(30),
    "an alias of itself": "rig: &a [*a]\n",
    "a merge of itself": "rig: &a {<<: *a}\n",
    "an anchor ten thousand times": "rig: [" + "&a a," * 10_000 + "]\n",
    "nested lists": "rig: " + "[" * 50_000,
    "nested mappings": "rig: " + "{a: " * 30_000,
    "nested blocks": "- " * 50_000,
    "nested keys": "? " * 50_000,
    "very many keys": "".join(f"k{i}: 1\n" for i in range(11_000)),
    "very many cables": "cables: [" + ", ".join(f"c{i}" for i in range(9_000)) + "]\n",
    "a long word": "rig: " + "a" * 130_000 + "\n",
    "a long number": "rig: " + "9" * 130_000 + "\n",
    "a long sum of sixties": "rig: " + "9:" * 60_000 + "9\n",
    "a tag of a program": "rig: !!python/object/apply:os.system [touch pwned]\n",
    "larger than a description": "# " + "x" * (1 << 18) + "\n",
    "no text": "rig: \x00\x01\n",
}


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def words(text: str) -> bytes:
    return struct.pack("<I", len(text.encode())) + text.encode()


def topic(channel: int, name: str) -> bytes:
    schema = struct.pack("<H", 1) + words("geometry_msgs/msg/WrenchStamped") + words("ros2msg") + words("")
    described = struct.pack("<HH", channel, 1) + words(name) + words("cdr") + words("")
    return record(3, schema) + record(4, described)


def message(channel: int, body: bytes) -> bytes:
    return record(5, struct.pack("<HIQQ", channel, 0, 1, 1) + body)


def chunk(records: bytes, compression: str = "zstd", claimed: int | None = None) -> bytes:
    packed = zstd.compress(records, 1) if compression == "zstd" else records
    size = len(records) if claimed is None else claimed
    body = struct.pack("<QQQI", 0, 1, size, 0) + words(compression) + struct.pack("<Q", len(packed)) + packed
    return record(6, body)


def mcap(*parts: bytes) -> bytes:
    return b"\x89MCAP0\r\n" + b"".join(parts) + record(15, bytes(4)) + record(2, bytes(20)) + b"\x89MCAP0\r\n"


def rosbag1(size: int) -> bytes:
    """A chunk of ROS 1 that unpacks to zeros."""
    packed = bz2.compress(bytes(size))
    header = b"".join(
        struct.pack("<I", len(field)) + field
        for field in (b"op=\x05", b"compression=bz2", b"size=" + struct.pack("<I", size))
    )
    return (
        b"#ROSBAG V2.0\n" + struct.pack("<I", len(header)) + header + struct.pack("<I", len(packed)) + packed
    )


def _very_many_topics() -> bytes:
    return mcap(chunk(b"".join(topic(1 + i % 60_000, f"/t{i}") for i in range(100_000))))


def _zeros(chunks: int) -> bytes:
    return mcap(*[chunk(bytes(IDLE))] * chunks)


def _file_of_zeros() -> bytes:
    packer = zstd.ZstdCompressor(1)
    parts = [packer.compress(mcap())] + [packer.compress(bytes(IDLE // 4)) for _ in range(48)]
    return b"".join([*parts, packer.flush()])


#: Name -> the bag's file, and what makes its content.
BAGS: dict[str, tuple[str, Callable[[], bytes]]] = {
    "a chunk of zeros": ("run.mcap", lambda: _zeros(1)),
    "a chunk beyond any recorder's": ("run.mcap", lambda: mcap(chunk(bytes(IDLE + 1)))),
    "thirty chunks of zeros": ("run.mcap", lambda: _zeros(30)),
    "a chunk that claims an exabyte": ("run.mcap", lambda: mcap(chunk(b"x", claimed=1 << 60))),
    "millions of empty messages": (
        "run.mcap",
        lambda: mcap(topic(1, WANTED), chunk(message(1, b"") * 3_000_000)),
    ),
    "millions of unknown records": ("run.mcap", lambda: mcap(chunk(record(200, b"") * 9_000_000))),
    "messages that repeat": (
        "run.mcap",
        lambda: mcap(topic(1, WANTED), *[chunk(message(1, bytes(60_000)) * 4_000)] * 8),
    ),
    "very many topics": ("run.mcap", _very_many_topics),
    "very many topics, each in a chunk": (
        "run.mcap",
        lambda: mcap(*(chunk(topic(i, f"/t{i}"), "") for i in range(60_000))),
    ),
    "a record longer than the file": ("run.mcap", lambda: mcap()[:8] + struct.pack("<BQ", 6, 1 << 62)),
    "a whole file of zeros": ("run.mcap.zstd", _file_of_zeros),
    "a packed file in a packed file": (
        "run.mcap.zstd",
        lambda: zstd.compress(zstd.compress(bytes(IDLE // 4), 1), 1),
    ),
    "zeros of ROS 1": ("run.bag", lambda: rosbag1(IDLE // 4)),
    "sqlite3 of nothing": ("run.db3", lambda: b"SQLite format 3\0" + b"\xff" * 5_000_000),
}


def write_session(folder: Path, name: str, content: bytes) -> Path:
    """A session of one run."""
    (folder / "run").mkdir(parents=True)
    (folder / "rig.yaml").write_text(RIG)
    (folder / "session.yaml").write_text("rig: rig.yaml\nrecordings: [{bag: run, kind: dynamic}]\n")
    (folder / "run" / name).write_bytes(content)
    return folder
