"""``columns.yaml``: what each column of a log is, and in which unit, for a person to read and edit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from rig_identification.errors import InputError, did_you_mean
from rig_identification.logs.log import Column, Log, Table
from rig_identification.logs.quantities import quantity, unknown
from rig_identification.logs.units import factor
from rig_identification.quantity import plain_figure
from rig_identification.session.fields import Fields, load_fields

FILE = "columns.yaml"


@dataclass(frozen=True)
class Chosen:
    """What one column is."""

    word: str  # of logs/quantities.py
    unit: str
    scale: float = 1.0  # -1: the axis points the other way


@dataclass(frozen=True)
class TimeColumn:
    """When a table's rows were measured: a column, or a constant rate where there is none."""

    column: str | None
    unit: str = "s"
    rate: float | None = None  # Hz


@dataclass(frozen=True)
class TableColumns:
    """The columns of one table that are used."""

    time: TimeColumn | None  # None: nothing says it, a person has to
    columns: Mapping[str, Chosen]


@dataclass(frozen=True)
class Columns:
    """The columns of a log that are used, by table."""

    tables: Mapping[str, TableColumns] = field(default_factory=dict)

    @property
    def cables(self) -> tuple[str, ...]:
        """Cables whose tension is among them."""
        words = [chosen.word for table in self.tables.values() for chosen in table.columns.values()]
        found = [one.cable for word in words if (one := quantity(word)) is not None and one.cable]
        return tuple(dict.fromkeys(found))

    def held_by(self, log: Log) -> Columns:
        """Those of the columns that a log holds; a table without its column of time is not used."""
        held = {}
        for name, chosen in self.tables.items():
            table = log.table(name)
            names = {column.name for column in table.columns} if table is not None else set()
            timed = chosen.time.column if chosen.time is not None else None
            if table is not None and (timed is None or timed in names):
                left = {column: one for column, one in chosen.columns.items() if column in names}
                held[name] = replace(chosen, columns=left)
        return Columns(held)

    def with_rate(self, rate: float | None) -> Columns:
        """The same with a rate (Hz) for each table that has no column of time."""
        if rate is None:
            return self
        timed = {n: replace(t, time=t.time or TimeColumn(None, rate=rate)) for n, t in self.tables.items()}
        return Columns(timed)


def read_columns(file: Path) -> Columns:
    """Read and validate a ``columns.yaml``.

    Raises
    ------
    InputError
        The first fault, as one line with file, key path, value and what to do.
    """
    return columns_from_fields(load_fields(file, "description of columns"))


def columns_from_fields(top: Fields) -> Columns:
    """Validate the content of a ``columns.yaml``. Raises InputError."""
    top.refuse_unknown(("tables",))
    tables = top.section("tables", "a mapping from tables to their columns")
    return Columns(
        {str(name): _table(tables.section(str(name), "time and columns")) for name in tables.values}
    )


def _table(fields: Fields) -> TableColumns:
    fields.refuse_unknown(("time", "columns"))
    time = fields.section("time", "the column of time, {column: t, unit: s}, or {rate: 200}")
    time.refuse_unknown(("column", "unit", "rate"))
    if time.has("rate"):
        when = TimeColumn(None, rate=time.number("rate", "Hz", above=0.0, at_most=1e6))
    else:
        when = TimeColumn(time.text("column", "the name of the column of time"), _unit(time, "s"))
    columns = fields.section("columns", "a mapping from columns to what they are")
    return TableColumns(when, {str(name): _chosen(columns, str(name)) for name in columns.values})


def _chosen(columns: Fields, name: str) -> Chosen:
    fields = columns.section(name, "{is: ..., unit: ...}")
    fields.refuse_unknown(("is", "unit", "scale"))
    word = fields.text("is", "what the column is")
    wanted = quantity(word)
    if wanted is None:
        raise fields.fault("is", unknown(word))
    scale = fields.number("scale", "1") if fields.has("scale") else 1.0
    if scale == 0.0:
        raise fields.fault("scale", "0 leaves nothing; remove the column, or give another factor")
    return Chosen(word, _unit(fields, wanted.unit), scale)


def _unit(fields: Fields, si: str) -> str:
    unit = str(fields.values.get("unit", si))
    factor(unit, si, f"{fields.file}: {fields.key_path('unit')}")  # refuses what is no unit of it
    return unit


def columns_text(columns: Columns, log: Log, remarks: Mapping[tuple[str, str], str], source: str) -> str:
    """The text of a ``columns.yaml`` with what each column holds as a comment, unused ones too."""
    lines = [
        f"# Columns of {source}: what each is, and in which unit. Edit it, then import again with --columns.",
        "# scale: -1 turns an axis round. A column that is left out is not used.",
        "tables:",
    ]
    for table in log.tables:
        lines += _table_lines(table, columns.tables.get(table.name), remarks)
    return "\n".join(lines) + "\n"


def _table_lines(
    table: Table, chosen: TableColumns | None, remarks: Mapping[tuple[str, str], str]
) -> list[str]:
    hidden = "" if chosen is not None else "# "
    lines = [f"{hidden}  {_quoted(table.name)}:"]
    time = chosen.time if chosen is not None else None
    if chosen is not None:
        lines.append(f"    time: {_time_text(time)}")
        lines.append("    columns:")
    for column in table.columns:
        if time is not None and column.name == time.column:
            continue
        used = chosen.columns.get(column.name) if chosen is not None else None
        remark = remarks.get((table.name, column.name), "" if used else "not used")
        told = "; ".join(filter(None, (_range(column), remark)))
        text = f"{{is: {used.word}, unit: {_quoted(used.unit)}}}" if used else "{is: , unit: }"
        lines.append(f"{'' if used else '# '}      {_quoted(column.name)}: {text}  # {told}")
    return lines


def _time_text(time: TimeColumn | None) -> str:
    if time is None:
        return "{rate: }  # no column of time was found: give the rate in Hz, or {column: NAME, unit: s}"
    if time.column is None:
        return f"{{rate: {time.rate:g}}}"
    return f"{{column: {_quoted(time.column)}, unit: {time.unit}}}"


def _range(column: Column) -> str:
    known = column.values[np.isfinite(column.values)]
    if not len(known):
        return "no number"
    return f"{plain_figure(float(known.min()))} to {plain_figure(float(known.max()))}"


def _quoted(text: str) -> str:
    """A text as YAML in a list in braces reads it back."""
    try:
        plain = YAML(typ="safe", pure=True).load(f"{{{text}: 0}}")
    except Exception:  # a name may hold anything
        plain = None
    return text if plain == {text: 0} else json.dumps(text, ensure_ascii=False)


def check_columns(columns: Columns, log: Log, source: str) -> None:
    """Refuse columns that a log does not hold, and tables without a time. Raises InputError."""
    for name, chosen in columns.tables.items():
        table = log.table(name)
        if table is None:
            known = [one.name for one in log.tables]
            raise InputError(
                f"{source}: holds no table {name}; it holds {', '.join(known)}{did_you_mean(name, known)}"
            )
        names = [column.name for column in table.columns]
        timed = [chosen.time.column] if chosen.time is not None and chosen.time.column else []
        for column in (*timed, *chosen.columns):
            if column not in names:
                raise InputError(
                    f"{source}: {name}: holds no column {column}; it holds {', '.join(names)}"
                    f"{did_you_mean(column, names)}"
                )
