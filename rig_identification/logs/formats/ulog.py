"""ULog files of PX4, by pyulog (``pip install 'rig_identification[ulog]'``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig_identification.errors import InputError
from rig_identification.logs.formats import begins
from rig_identification.logs.log import Column, Log, Table
from rig_identification.optional import needed

NAME, ORDER = "ULog", 10
TIME = "timestamp"
#: The time at which a sensor was read, where a message states it beside that of its logging.
_MEASURED = "timestamp_sample"
#: Beginnings of fields -> unit. PX4's messages are in SI units.
_UNITS = {"gyro_rad": "rad/s", "accelerometer_m_s2": "m/s^2"}
_OF_TOPIC = {"sensor_gyro": "rad/s", "sensor_accel": "m/s^2"}


def holds(path: Path) -> bool:
    """By the first bytes."""
    return begins(path, b"ULog\x01\x12\x35")


def read(path: Path) -> Log:
    """A table a topic, timed by the device's clock. Raises InputError."""
    ulog = needed("pyulog", f"{path}: ULog", "ulog").ULog(str(path))
    tables = []
    for topic in ulog.data_list:
        stamp = _MEASURED if np.any(topic.data.get(_MEASURED, np.zeros(1))) else TIME
        columns = [Column(TIME, np.asarray(topic.data[stamp], dtype=float), "us")]
        for name, values in topic.data.items():
            if name not in (TIME, _MEASURED) and np.asarray(values).dtype.kind in "fiu":
                columns.append(Column(_axis(name), np.asarray(values, dtype=float), _unit(topic.name, name)))
        instance = f" {topic.multi_id}" if topic.multi_id else ""
        tables.append(Table(f"{topic.name}{instance}", tuple(columns)))
    if not tables:
        raise InputError(f"{path}: holds no topic with numbers")
    return Log(tuple(tables))


def _axis(name: str) -> str:
    """``gyro_rad[0]`` is that about x."""
    for place, axis in enumerate("xyz"):
        if name.endswith(f"[{place}]"):
            return f"{name[:-3]} {axis}"
    return name


def _unit(topic: str, name: str) -> str:
    if name in ("x", "y", "z"):
        return _OF_TOPIC.get(topic, "")
    return next((unit for beginning, unit in _UNITS.items() if name.startswith(beginning)), "")
