"""Exports of phone loggers: a folder, or a zip, with one CSV a sensor, by phyphox or by Sensor Logger.

phyphox writes units into its headers and the time of the start into ``meta/time.csv``. Sensor Logger states
no units: https://github.com/tszheichoi/awesome-sensor-logger (UNITS.md, CROSSPLATFORM.md) does. On an iPhone
its acceleration has the opposite sign unless "Standardise Units & Frames" is on; ``Metadata.csv`` tells.
"""

from __future__ import annotations

import csv
import zipfile
from pathlib import Path, PurePosixPath

import numpy as np

from rig_identification.errors import InputError
from rig_identification.logs.formats.csv_text import table_of, text_of
from rig_identification.logs.log import Column, Log, Table

NAME, ORDER = "phone logger (phyphox, Sensor Logger)", 30
_SECONDS, _NANOSECONDS = "seconds_elapsed", "time"
_UNITS = {"Gyroscope": "rad/s", "TotalAcceleration": "m/s^2"}


def holds(path: Path) -> bool:
    """A zip, or a folder with CSV files in it and nothing that makes it a session."""
    if path.is_dir():
        return any(path.glob("*.csv")) and not (path / "session.yaml").exists()
    return path.suffix.lower() == ".zip" and zipfile.is_zipfile(path)


def read(path: Path) -> Log:
    """A table a sensor, without those that no rig uses. Raises InputError."""
    texts = _texts(path)
    tables = {}
    for name, text in texts.items():
        inner = PurePosixPath(name)
        if inner.parent.name == "meta" or inner.stem in ("Metadata", "Annotation"):
            continue
        try:
            tables[inner.stem] = table_of(text, f"{path}: {name}", inner.stem)
        except InputError:  # a sensor that recorded nothing, or a list of events
            continue
    if not tables:
        raise InputError(f"{path}: holds no table of a sensor; export it as CSV")
    if any(table.column(_SECONDS) is not None for table in tables.values()):
        return Log(_sensor_logger(tables, texts))
    return Log(tuple(tables.values()), _start_of_phyphox(texts))


def _texts(path: Path) -> dict[str, str]:
    """CSV files by their paths inside the folder or zip."""
    if path.is_dir():
        files = sorted(path.rglob("*.csv"))
        return {file.relative_to(path).as_posix(): text_of(file.read_bytes()) for file in files}
    with zipfile.ZipFile(path) as archive:
        names = sorted(name for name in archive.namelist() if name.lower().endswith(".csv"))
        return {name: text_of(archive.read(name)) for name in names}


def _start_of_phyphox(texts: dict[str, str]) -> int | None:
    """ns since 1970 of the experiment's time 0; None where the export does not tell."""
    for name, text in texts.items():
        if PurePosixPath(name).name == "time.csv" and PurePosixPath(name).parent.name == "meta":
            for row in csv.DictReader(text.splitlines()):
                if row.get("event") == "START":
                    return round((float(row["system time"]) - float(row["experiment time"])) * 1e9)
    return None


def _sensor_logger(tables: dict[str, Table], texts: dict[str, str]) -> tuple[Table, ...]:
    """Gyroscope and acceleration with gravity, in SI units and with Android's signs."""
    sign = _sign(texts)
    out = []
    if (rate := tables.get("Gyroscope")) is not None:
        out.append(_sensor(rate, "Gyroscope", 1.0, None))
    if (total := tables.get("TotalAcceleration")) is not None:
        out.append(_sensor(total, "TotalAcceleration", sign, None))
    elif "Accelerometer" in tables and "Gravity" in tables:
        felt, gravity = tables["Accelerometer"], tables["Gravity"]
        if len(felt.columns[0].values) == len(gravity.columns[0].values):
            out.append(_sensor(felt, "TotalAcceleration", sign, gravity))
    used = {"Gyroscope", "TotalAcceleration", "Accelerometer", "Gravity"}
    return (*out, *(table for name, table in tables.items() if name not in used))


def _sensor(table: Table, name: str, sign: float, added: Table | None) -> Table:
    """Time, then x, y and z in the sensor's unit, with those of ``added`` where it is given."""
    columns = []
    stamp = table.column(_NANOSECONDS)
    if stamp is not None:
        columns.append(Column(_NANOSECONDS, stamp.values, "ns"))
    for axis in "xyz":
        column = table.column(axis)
        if column is None:
            raise InputError(f"{name}.csv: has no column {axis}; export it again")
        other = added.column(axis) if added is not None else None
        values = sign * (column.values + (np.zeros(1) if other is None else other.values))
        columns.append(Column(axis, values, _UNITS[name]))
    return Table(name, tuple(columns))


def _sign(texts: dict[str, str]) -> float:
    """-1 for an iPhone's own convention, in which a phone at rest reads gravity downwards."""
    for name, text in texts.items():
        if PurePosixPath(name).stem == "Metadata":
            for row in csv.DictReader(text.splitlines()):
                standard = str(row.get("standardisation", "")).lower() == "true"
                return -1.0 if str(row.get("platform", "")).lower() == "ios" and not standard else 1.0
    return 1.0
