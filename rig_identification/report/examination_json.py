"""What ``check`` found out, as plain JSON: the whole of it, and the part that ``result.json`` holds."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from rig_identification.examination import Examination
from rig_identification.report.plain import plain


def examination_to_dict(examination: Examination) -> dict[str, object]:
    """Every field of an examination; what is not finite becomes None."""
    return {
        "session": examination.session,
        "faults": plain([asdict(fault) for fault in examination.faults]),
        "warnings": list(examination.warnings),
        "rest": plain([asdict(reading) for reading in examination.rest]),
        "topics": plain([asdict(topic) for topic in examination.topics]),
        "notes": list(examination.notes),
    }


def check_part(examination: Examination) -> dict[str, object]:
    """``check`` of ``result.json``: faults, warnings and topics."""
    whole = examination_to_dict(examination)
    return {key: whole[key] for key in ("faults", "warnings", "topics")}


def examination_text(examination: Examination) -> str:
    """:func:`examination_to_dict` as strict JSON: no NaN, no infinity."""
    return json.dumps(examination_to_dict(examination), indent=2, allow_nan=False, ensure_ascii=False)


def write_examination(examination: Examination, path: Path) -> None:
    """Write :func:`examination_text` to a file."""
    path.write_text(examination_text(examination) + "\n", encoding="utf-8")
