"""A log and the meaning of its columns to recordings of the contract: units changed, nothing else.

Samples are neither filtered nor brought to a common rate. What an IMU's gyroscope and accelerometer
measured at different times stays apart, each message with NaN for what it does not hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.logs.columns import Columns, TableColumns, check_columns
from rig_identification.logs.log import Array, Log, Table
from rig_identification.logs.quantities import WIDTH, Quantity, quantity
from rig_identification.logs.units import factor
from rig_identification.recording import Recording, Series

#: s. Times below this count from some start and are no date: the year 1973, or a device that ran three years.
_FIRST_DATE = 1e8
#: s between the starts of logs without a date. They stand apart and in the order in which they are given.
BETWEEN = 3600.0

_Key = tuple[str, str | None]  # channel, cable


def recording_of(log: Log, columns: Columns, name: str, source: str, number: int = 0) -> Recording:
    """The recording that a log holds.

    Parameters
    ----------
    log : Log
    columns : Columns
        What its columns are.
    name : str
        Of the recording.
    source : str
        The file, for messages.
    number : int
        Place among the logs of a session: orders those without a date.

    Raises
    ------
    InputError
        A column that is not there, a table without a time, or nothing that is used.
    """
    check_columns(columns, log, source)
    pieces: dict[_Key, list[tuple[Array, Array]]] = {}
    for table_name, chosen in columns.tables.items():
        table = log.table(table_name)
        assert table is not None
        time = _time(table, chosen, source)
        for key, values in _channels(table, chosen, source):
            known = np.isfinite(time) & np.isfinite(values).any(axis=1)
            if known.any():
                pieces.setdefault(key, []).append((time[known], values[known]))
    if not pieces:
        raise InputError(f"{source}: holds no column that is used; say in columns.yaml what its columns are")
    joined = {key: _joined(parts) for key, parts in pieces.items()}
    return _recording(joined, log.start_ns, name, number)


def _recording(
    channels: dict[_Key, tuple[Array, Array]], start_ns: int | None, name: str, number: int
) -> Recording:
    begin = min(float(time.min()) for time, _ in channels.values())
    end = max(float(time.max()) for time, _ in channels.values())
    if begin >= _FIRST_DATE:
        first_ns = round(begin * 1e9)
    elif start_ns is not None:
        first_ns = start_ns + round(begin * 1e9)
    else:  # no date: stamps that no reader takes for one
        first_ns = round((number + 1) * BETWEEN * 1e9)
    series = {key: Series(time - begin, values) for key, (time, values) in channels.items()}
    fixed: dict[str, Any] = {channel: one for (channel, cable), one in series.items() if cable is None}
    tension = {cable: one for (_, cable), one in series.items() if cable is not None}
    return Recording(name, "dynamic", False, first_ns, end - begin, tension=tension, **fixed)


def _time(table: Table, chosen: TableColumns, source: str) -> Array:
    """(n,) s."""
    where = f"{source}: {table.name}"
    if chosen.time is None:
        raise InputError(f"{where}: no column of time is named; give time: {{column: NAME, unit: s}} or rate")
    if chosen.time.column is None:
        assert chosen.time.rate is not None
        return np.arange(len(table.columns[0].values)) / chosen.time.rate
    column = table.column(chosen.time.column)
    assert column is not None
    return column.values * factor(chosen.time.unit, "s", where)


def _channels(table: Table, chosen: TableColumns, source: str) -> Iterator[tuple[_Key, Array]]:
    """Of each channel that a table holds: what it is, and its columns (n, width), NaN where there is none."""
    found: dict[_Key, list[tuple[Quantity, Array]]] = {}
    for name, one in chosen.columns.items():
        wanted, column = quantity(one.word), table.column(name)
        assert wanted is not None
        assert column is not None
        in_si = factor(one.unit, wanted.unit, f"{source}: {table.name}: {name}") * one.scale
        found.setdefault((wanted.channel, wanted.cable), []).append((wanted, column.values * in_si))
    for key, parts in found.items():
        values = np.full((len(parts[0][1]), WIDTH[key[0]]), np.nan)
        turns = {wanted.part: numbers for wanted, numbers in parts if not wanted.part.isdigit()}
        for wanted, numbers in parts:
            if wanted.part.isdigit():
                values[:, int(wanted.part)] = numbers
        if turns:
            values[:, 3:7] = _quaternion(turns, source)
        yield key, values


def _quaternion(turns: dict[str, Array], source: str) -> Array:
    """(n, 4) xyzw of roll, pitch and yaw about x, y and z, yaw first; of yaw alone with NaN for x and y."""
    if set(turns) == {"yaw"}:
        half = 0.5 * turns["yaw"]
        unknown = np.full(len(half), np.nan)
        return np.column_stack((unknown, unknown, np.sin(half), np.cos(half)))
    missing = {"roll", "pitch", "yaw"} - set(turns)
    if missing:
        raise InputError(f"{source}: mocap.{min(missing)}: missing; give roll, pitch and yaw, or yaw alone")
    angles = np.column_stack((turns["yaw"], turns["pitch"], turns["roll"]))
    out = np.full((len(angles), 4), np.nan)
    known = np.isfinite(angles).all(axis=1)
    out[known] = Rotation.from_euler("ZYX", angles[known]).as_quat()
    return out


def _joined(parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Samples of a device that several tables hold, in the order of time.

    Those of one instant become one sample. The others keep NaN where their table holds nothing.
    """
    if len(parts) == 1:
        return parts[0]
    time = np.concatenate([when for when, _ in parts])
    values = np.concatenate([held for _, held in parts])
    order = np.argsort(time, kind="stable")
    time, values = time[order], values[order]
    # Stamps are whole nanoseconds on disk.
    first = np.append(True, np.diff(np.round(time * 1e9)) > 0.0)
    together = np.cumsum(first) - 1
    merged = np.full((int(first.sum()), values.shape[1]), np.nan)
    for row, known in zip(together, zip(values, np.isfinite(values), strict=True), strict=True):
        merged[row, known[1]] = known[0][known[1]]
    return time[first], merged
