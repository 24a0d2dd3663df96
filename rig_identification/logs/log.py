"""What a reader of a format returns: tables of named columns, units as the file states them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Name of the table of a file that holds one.
ONLY = "table"


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str  # as in the file
    values: Array  # (n,) NaN: no number there
    unit: str = ""  # as the file states it; "": it does not


@dataclass(frozen=True)
class Table:
    """Columns of equal length that were sampled together."""

    name: str
    columns: tuple[Column, ...]

    def column(self, name: str) -> Column | None:
        """The column of a name."""
        return next((column for column in self.columns if column.name == name), None)


@dataclass(frozen=True)
class Log:
    """One file, or one folder of files that an app exports together."""

    tables: tuple[Table, ...]
    start_ns: int | None = None  # since 1970, of time 0 where times count from the start; None: not stated
    notes: tuple[str, ...] = ()  # sentences on how it was read

    def table(self, name: str) -> Table | None:
        """The table of a name."""
        return next((table for table in self.tables if table.name == name), None)


def of_all(logs: Sequence[Log]) -> Log:
    """Every table and column that any of the logs holds, each from the first one that holds it.

    It stands for what the columns are called and what they hold. Columns of one table may differ in length.
    """
    found: dict[str, dict[str, Column]] = {}
    for log in logs:
        for table in log.tables:
            columns = found.setdefault(table.name, {})
            for column in table.columns:
                columns.setdefault(column.name, column)
    return Log(tuple(Table(name, tuple(columns.values())) for name, columns in found.items()))


def numbered(names: list[str]) -> list[str]:
    """Names that differ: the second ``x`` becomes ``x #2``, an empty one the number of its place."""
    seen: dict[str, int] = {}
    out = []
    for place, name in enumerate(names, start=1):
        plain = name.strip() or f"column {place}"
        seen[plain] = seen.get(plain, 0) + 1
        out.append(plain if seen[plain] == 1 else f"{plain} #{seen[plain]}")
    return out
