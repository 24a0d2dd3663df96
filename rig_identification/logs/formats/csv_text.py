"""CSV and other text tables: separator, decimal comma, header, a row of units and times of day are found."""

from __future__ import annotations

import codecs
import csv
import re
from datetime import datetime, timezone
from pathlib import Path

import numpy as np

from rig_identification.errors import InputError
from rig_identification.logs.log import ONLY, Array, Column, Log, Table, numbered
from rig_identification.logs.units import known_unit

NAME, ORDER = "CSV", 90
SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".asc")

#: Rows that separator and decimal comma are judged by.
_LOOKED_AT = 50
_SEPARATORS = (";", "\t", ",", None)  # None: blanks
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)", re.IGNORECASE)
_WITH_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")


def holds(path: Path) -> bool:
    """By the name's ending."""
    return path.is_file() and path.suffix.lower() in SUFFIXES


def read(path: Path) -> Log:
    """One table. Raises InputError where no row of numbers is found."""
    return Log((table_of(text_of(path.read_bytes()), str(path), ONLY),))


def text_of(data: bytes) -> str:
    """Text in UTF-8 or UTF-16 by its mark, else in Latin-1, which any bytes are."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def table_of(text: str, where: str, name: str) -> Table:
    """The table in a text; ``where`` begins the message of a fault."""
    lines = [line for line in text.splitlines() if line.strip()]
    for separator in _SEPARATORS:
        first = _first_row(lines, separator)
        if first is not None:
            return _table(lines, first, separator, name)
    raise InputError(f"{where}: holds no two rows of numbers one below the other; export it as CSV")


def _first_row(lines: list[str], separator: str | None) -> int | None:
    """Number of the first line from which on lines hold numbers, two or more, and equally many fields."""
    for number, line in enumerate(lines[: 4 * _LOOKED_AT]):
        fields = _fields(line, separator)
        below = lines[number + 1 : number + 1 + _LOOKED_AT]
        if below and number + 1 + len(below) == len(lines):
            below = below[:-1] or below  # a log that was cut off ends within a row
        if len(fields) < 2 or not below or not _is_data(fields):
            continue
        if all(len(_fields(other, separator)) == len(fields) for other in below):
            return number
    return None


def _fields(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    return [field.strip() for field in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def _is_data(fields: list[str]) -> bool:
    """Whether a row holds a number, and nothing but numbers, times of day, empty fields and some words."""
    return any(_is_number(field) for field in fields) and bool(_is_number(fields[0]) or _moment(fields[0]))


def _is_number(field: str) -> bool:
    return bool(_NUMBER.fullmatch(field) or _WITH_COMMA.fullmatch(field))


def _table(lines: list[str], first: int, separator: str | None, name: str) -> Table:
    width = len(_fields(lines[first], separator))
    names, units = _header([_fields(line.lstrip("#% "), separator) for line in lines[:first]], width)
    below = lines[first:]
    rows = map(str.split, below) if separator is None else csv.reader(below, delimiter=separator)
    whole = [row for row in rows if len(row) == width]
    # With points for decimals, 1,5 is no number of one field: then the comma separates.
    comma = separator != "," and any(
        _WITH_COMMA.fullmatch(field) for row in whole[:_LOOKED_AT] for field in row
    )
    columns = tuple(
        Column(title, _numbers([row[i] for row in whole], comma), unit)
        for i, (title, unit) in enumerate(zip(names, units, strict=True))
    )
    return Table(name, columns)


def _header(above: list[list[str]], width: int) -> tuple[list[str], list[str]]:
    """Names and units of the columns: of the last row above the numbers, or of two, names over units."""
    fitting = [row for row in above if len(row) == width]
    if not fitting:
        return [f"column {place}" for place in range(1, width + 1)], [""] * width
    last = fitting[-1]
    stated = [known_unit(text) if text else "" for text in last]
    if (
        len(fitting) > 1
        and any(stated)
        and all(unit or not text for unit, text in zip(stated, last, strict=True))
    ):
        return numbered(fitting[-2]), stated
    return numbered(last), [""] * width


def _numbers(texts: list[str], comma: bool) -> Array:
    """(n,) numbers of a column; of times of day the seconds since 1970; NaN where a text is neither."""
    if comma:
        texts = [text.replace(",", ".") for text in texts]
    try:
        return np.array(texts, dtype=float)
    except ValueError:
        pass
    of_one = _moment if _moment(texts[0]) is not None else _number
    return np.array([np.nan if (value := of_one(text)) is None else value for text in texts])


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _moment(text: str) -> float | None:
    """Seconds since 1970 of a date with a time, ISO 8601; without a zone it is taken as UTC."""
    try:
        moment = datetime.fromisoformat(text.replace("Z", "+00:00"))
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=timezone.utc)).timestamp()
