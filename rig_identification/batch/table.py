"""The table of a batch: a row a session, as JSON and as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rig_identification.batch.record import DEFECT, DONE, Record
from rig_identification.batch.sessions import Listed
from rig_identification.result import ELEMENTS

#: What stands before the columns of the body without its carrying frame.
ALONE = "vehicle_"
RESULT = "result.json"
FIRST = ("session", "status", "verdict", "findings", "unobservable")
LAST = ("hash", "result", "message")


def row(session: Listed, record: Record, folder: Path) -> dict[str, object]:
    """One session's row. ``folder``: where its result lies."""
    told: dict[str, object] = {"session": session.name, "status": record.status, "hash": record.hash}
    told |= {"message": record.message, "result": None}
    if record.status != DONE:
        return told
    try:
        document = json.loads((folder / RESULT).read_text(encoding="utf-8"))
        return told | _of_result(document) | {"result": f"{session.name}/{RESULT}"}
    except (OSError, ValueError, KeyError, TypeError) as error:
        return told | {"status": DEFECT, "message": f"{RESULT} cannot be read: {error}"}


def table_json(rows: Sequence[Mapping[str, object]], version: str) -> str:
    """``{"version", "sessions": [row, ...]}``: null where there is no number."""
    return json.dumps({"version": version, "sessions": list(rows)}, indent=1, ensure_ascii=False) + "\n"


def table_csv(rows: Sequence[Mapping[str, object]]) -> str:
    """The same as comma-separated values: SI units, empty where there is no number."""
    names = [*_columns("")]
    if any(f"{ALONE}m" in row for row in rows):
        names += _columns(ALONE)
    out = io.StringIO()
    writer = csv.DictWriter(out, [*FIRST, *names, *LAST], extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for told in rows:
        writer.writerow({key: _cell(value) for key, value in told.items()})
    return out.getvalue()


def _columns(prefix: str) -> list[str]:
    return [column for name in ELEMENTS for column in (f"{prefix}{name}", f"{prefix}{name}_std")]


def _cell(value: object) -> object:
    if isinstance(value, list):
        return " ".join(map(str, value))
    return repr(value) if isinstance(value, float) else value


def _of_result(document: Mapping[str, Any]) -> dict[str, object]:
    mismatch = document["mismatch"]
    out = {
        "verdict": mismatch["verdict"],
        "findings": [finding["effect"] for finding in mismatch["findings"]],
        "unobservable": list(document["unobservable"]),
        **_ten(document, ""),
    }
    alone = document["without_frame"]
    return out if alone is None else out | _ten(alone, ALONE)


def _ten(document: Mapping[str, Any], prefix: str) -> dict[str, object]:
    """The ten numbers and their stds by column."""
    out: dict[str, object] = {}
    for key, ending in (("value", ""), ("std", "_std")):
        tensor = document["inertia"][key]
        upper = [tensor[i][j] for i in range(3) for j in range(i, 3)]
        ten = [document["mass"][key], *document["center_of_mass"][key], *upper]
        out |= {f"{prefix}{name}{ending}": value for name, value in zip(ELEMENTS, ten, strict=True)}
    return out
