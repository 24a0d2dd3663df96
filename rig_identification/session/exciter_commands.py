"""The exciter's commands over time, as ``rig-identification plan`` writes them to ``exciter.csv``."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from rig_identification.errors import InputError
from rig_identification.recording import Series
from rig_identification.session.fields import shown
from rig_identification.session.yaml_text import TooMuch, read_text

#: Columns of the file. Speed and angle are those of an unbalanced mass' shaft, else empty.
HEAD = ("recording", "time_s", "speed_hz", "angle_rad", "force_x_N", "force_y_N", "force_z_N")
#: Bytes of a file: five hours of commands, 50 lines a second.
LARGEST_COMMANDS = 1 << 24
_NUMBERS = ("time_s", "force_x_N", "force_y_N", "force_z_N")


def read_commands(file: Path) -> dict[str, Series]:
    """Planned force of each run that the exciter drives.

    Returns
    -------
    dict
        Recording's name -> times (n,) s after the exciter's start, force (n, 3) N in the exciter frame.

    Raises
    ------
    InputError
        The file cannot be read, lacks a column, or holds a line that is no command.
    """
    try:
        text = read_text(file, LARGEST_COMMANDS)
    except OSError as error:
        raise InputError(
            f"{file}: {error.strerror}; name an exciter.csv of rig-identification plan"
        ) from error
    except (TooMuch, UnicodeDecodeError) as error:
        told = "is no text" if isinstance(error, UnicodeDecodeError) else str(error)
        raise InputError(f"{file}: {told}") from error
    rows = csv.reader(text.splitlines())
    try:
        columns = _columns(file, next(rows, []))
        held: dict[str, list[tuple[float, ...]]] = {}
        for row in rows:
            if row:
                name, *numbers = _command(file, rows.line_num, row, columns)
                held.setdefault(str(name), []).append(tuple(map(float, numbers)))
    except csv.Error as error:
        raise InputError(f"{file}: line {rows.line_num}: {error}") from error
    if not held:
        raise InputError(f"{file}: holds no command; give a plan with runs that the exciter drives")
    return {name: _series(file, name, np.array(lines)) for name, lines in held.items()}


def _columns(file: Path, head: list[str]) -> dict[str, int]:
    """Where each column stands that is needed."""
    places = {name.strip(): place for place, name in enumerate(head)}
    for name in ("recording", *_NUMBERS):
        if name not in places:
            raise InputError(
                f"{file}: line 1: column {name} is missing; the first line must read {','.join(HEAD)}"
            )
    return {name: places[name] for name in ("recording", *_NUMBERS)}


def _command(file: Path, line: int, row: list[str], columns: dict[str, int]) -> list[str | float]:
    """Name, s and N of one line."""
    out: list[str | float] = []
    for name, place in columns.items():
        if place >= len(row):
            raise InputError(f"{file}: line {line}: {name}: missing; the line has {len(row)} columns")
        if name == "recording":
            out.append(row[place].strip())
            continue
        try:
            number = float(row[place])
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise InputError(f"{file}: line {line}: {name}: {shown(row[place])} is not a finite number")
        out.append(number)
    return out


def _series(file: Path, name: str, lines: np.ndarray) -> Series:
    if len(lines) < 2:
        raise InputError(f"{file}: {shown(name)}: one command is no run; give two at least")
    if np.any(np.diff(lines[:, 0]) <= 0.0):
        at = lines[int(np.argmax(np.diff(lines[:, 0]) <= 0.0)) + 1, 0]
        raise InputError(f"{file}: {shown(name)}: time_s does not run forwards at {at:g} s; sort its lines")
    return Series(lines[:, 0], lines[:, 1:])
