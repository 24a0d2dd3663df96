"""Bags of ROS 1, and of ROS 2 with messages that the contract does not know: a table a topic, by rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rig_identification.errors import InputError
from rig_identification.logs.log import Column, Log, Table

NAME, ORDER = "ROS bag", 20
SUFFIXES = (".bag", ".mcap", ".db3")
#: Entries of an array that are taken apart; a longer one is an image, a scan or a covariance.
_LONGEST = 8
#: Last parts of a field's path -> unit, as ROS has it (REP 103).
_UNITS = {
    "angular_velocity": "rad/s",
    "linear_acceleration": "m/s^2",
    "force": "N",
    "position": "m",
    "translation": "m",
    "orientation": "1",
    "rotation": "1",
}
STAMP = "stamp"


def holds(path: Path) -> bool:
    """A bag's file, or the folder of a ROS 2 bag."""
    return path.suffix.lower() in SUFFIXES if path.is_file() else (path / "metadata.yaml").is_file()


def read(path: Path) -> Log:
    """A table a topic: its numbers by their paths in the message, and its stamps. Raises InputError."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    found: dict[str, list[dict[str, float]]] = {}
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, received, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            row = dict(_numbers("", message))
            row[STAMP] = _stamp(message, received)
            found.setdefault(connection.topic, []).append(row)
    tables = [_table(topic, rows) for topic, rows in found.items()]
    kept = tuple(table for table in tables if len(table.columns) > 1)
    if not kept:
        raise InputError(f"{path}: holds no topic with numbers")
    return Log(kept)


def _table(topic: str, rows: list[dict[str, float]]) -> Table:
    names = list(dict.fromkeys(name for row in rows for name in row if name != STAMP))
    columns = [Column(STAMP, np.array([row[STAMP] for row in rows]), "s")]
    for name in names:
        values = np.array([row.get(name, np.nan) for row in rows])
        columns.append(Column(name, values, _unit(name)))
    return Table(topic, tuple(columns))


def _unit(name: str) -> str:
    return next((unit for part, unit in _UNITS.items() if part in name.split(".")[:-1]), "")


def _stamp(message: Any, received_ns: int) -> float:
    """s: of the header where it has one, else when the recorder got the message."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        return received_ns * 1e-9
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def _numbers(path: str, value: Any) -> Iterator[tuple[str, float]]:
    """Numbers of a message by their paths: ``angular_velocity.x``."""
    if isinstance(value, (bool, str, bytes)) or path.endswith("covariance") or path == "header":
        return
    if isinstance(value, (int, float, np.number)):
        yield path, float(value)
    elif isinstance(value, (list, tuple, np.ndarray)):
        if len(value) <= _LONGEST:
            for place, inner in enumerate(value):
                yield from _numbers(f"{path}.{place}", inner)
    elif hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if not name.startswith("__"):
                yield from _numbers(f"{path}.{name}" if path else name, getattr(value, name))
