"""MDF files (3 and 4) of measurement systems, by asammdf (``pip install 'rig_identification[mdf]'``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from rig_identification.errors import InputError
from rig_identification.logs.formats import begins
from rig_identification.logs.log import Column, Log, Table, numbered
from rig_identification.optional import needed

NAME, ORDER = "MDF", 10
TIME = "time"


def holds(path: Path) -> bool:
    """By the first bytes."""
    return begins(path, b"MDF     ")


def read(path: Path) -> Log:
    """A table a channel group, timed by its master channel. Raises InputError."""
    asammdf = needed("asammdf", f"{path}: MDF", "mdf")
    tables = []
    with asammdf.MDF(str(path)) as file:
        start_ns = round(file.start_time.timestamp() * 1e9)
        for number, group in enumerate(file.groups):
            signals = [
                file.get(group=number, index=place)
                for place, channel in enumerate(group.channels)
                if place != file.masters_db.get(number)
            ]
            plain = [
                signal
                for signal in signals
                if signal.samples.dtype.kind in "fiu" and signal.samples.ndim == 1
            ]
            if plain and len(plain[0].samples) > 1:
                names = numbered([signal.name for signal in plain])
                columns = [Column(TIME, np.asarray(plain[0].timestamps, dtype=float), "s")]
                columns += [
                    Column(name, np.asarray(signal.samples, dtype=float), signal.unit or "")
                    for name, signal in zip(names, plain, strict=True)
                ]
                tables.append(Table(group.channel_group.acq_name or f"group {number + 1}", tuple(columns)))
    if not tables:
        raise InputError(f"{path}: holds no group of channels with numbers")
    return Log(tuple(tables), start_ns)
