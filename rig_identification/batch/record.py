"""What became of one session of a batch: ``batch.json`` beside its result."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from rig_identification.batch.fingerprint import Seen

NAME = "batch.json"
#: What became of a session. What was stopped from outside or is a defect is tried again, the others are not.
DONE, UNUSABLE, DEFECT, STOPPED = "done", "unusable", "defect", "stopped"
SETTLED = frozenset({DONE, UNUSABLE})


@dataclass(frozen=True)
class Record:
    """What became of one session."""

    status: str
    hash: str
    message: str = ""  # one line: why there is no result
    files: Mapping[str, Seen] = field(default_factory=dict)


def read_record(folder: Path) -> Record | None:
    """The record of the last time; None where there is none that can be read."""
    try:
        told = json.loads((folder / NAME).read_text(encoding="utf-8"))
        files = {path: Seen(**seen) for path, seen in told["files"].items()}
        return Record(str(told["status"]), str(told["hash"]), str(told["message"]), files)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def write_record(record: Record, folder: Path) -> None:
    """Write the record; whoever reads it sees the old one or the new one."""
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / NAME, json.dumps(asdict(record), indent=1) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a file aside, and put it in its place once it is complete."""
    handle, aside = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            stream.write(text)
        os.chmod(aside, 0o644)  # mkstemp lets nobody else read it
        os.replace(aside, path)
    except BaseException:
        Path(aside).unlink(missing_ok=True)
        raise
