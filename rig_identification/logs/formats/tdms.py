"""TDMS files of LabVIEW, by npTDMS (``pip install 'rig_identification[tdms]'``)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rig_identification.errors import InputError
from rig_identification.logs.formats import begins
from rig_identification.logs.log import Array, Column, Log, Table
from rig_identification.optional import needed

NAME, ORDER = "TDMS", 10
TIME = "time"


def holds(path: Path) -> bool:
    """By the first bytes."""
    return begins(path, b"TDSm")


def read(path: Path) -> Log:
    """A table a group, timed by its waveforms' start and increment if they have one. Raises InputError."""
    nptdms = needed("nptdms", f"{path}: TDMS", "tdms")
    tables = []
    for group in nptdms.TdmsFile.read(str(path)).groups():
        channels = [c for c in group.channels() if len(c) > 1 and np.asarray(c[:]).dtype.kind in "fiuM"]
        # Channels of a group may have rates of their own.
        for length in dict.fromkeys(len(channel) for channel in channels):
            alike = [channel for channel in channels if len(channel) == length]
            one_length = all(len(channel) == length for channel in channels)
            name = group.name if one_length else f"{group.name} {alike[0].name}"
            tables.append(Table(name, tuple(_columns(alike))))
    if not tables:
        raise InputError(f"{path}: holds no group of channels with numbers")
    return Log(tuple(tables))


def _columns(channels: list[Any]) -> list[Column]:
    increment = channels[0].properties.get("wf_increment", 0.0)
    columns = [] if not increment else [Column(TIME, _waveform_time(channels[0]), "s")]
    for channel in channels:
        columns.append(
            Column(channel.name, _numbers(channel[:]), str(channel.properties.get("unit_string", "")))
        )
    return columns


def _waveform_time(channel: Any) -> Array:
    """(n,) s, since 1970 where the waveform states when it starts."""
    start = channel.properties.get("wf_start_time")
    first = 0.0 if start is None else np.datetime64(start).astype("datetime64[ns]").astype(np.int64) * 1e-9
    offset = float(channel.properties.get("wf_start_offset", 0.0))
    return np.asarray(first + offset + float(channel.properties["wf_increment"]) * np.arange(len(channel)))


def _numbers(values: Any) -> Array:
    array = np.asarray(values)
    if array.dtype.kind == "M":  # a channel of times of day
        return np.asarray(array.astype("datetime64[ns]").astype(np.int64) * 1e-9)
    return np.asarray(array, dtype=float)
