"""Which session a report is about: when it was recorded, and a digest of what was identified."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from datetime import datetime, timezone

import numpy as np

from rig_identification import __version__
from rig_identification.recording import Session

#: ns: stamps before the year 2000 are no date, but seconds after some start.
_FIRST_DATE = 946_684_800 * 10**9
#: What says how a bag was read, a simulation's truth, and a vehicle's wheels: no part of what was identified.
_ASIDE = frozenset({"quality", "notes", "ground_truth", "vehicle"})


def recorded_on(session: Session) -> str:
    """Date and time (UTC) of the earliest stamp; "" where stamps tell no date."""
    first = min((r.start_ns for r in session.recordings), default=0)
    if first < _FIRST_DATE:
        return ""
    return datetime.fromtimestamp(first / 1e9, tz=timezone.utc).strftime("%Y-%m-%d %H:%M UTC")


def digest(session: Session) -> str:
    """Twelve hexadecimal digits of SHA-256 over the rig description and every sample that was used."""
    found = hashlib.sha256()
    for part in _parts(session):
        found.update(part)
    return found.hexdigest()[:12]


def provenance(session: Session, files: Mapping[str, str]) -> dict[str, object]:
    """What an answer comes from. files: SHA-256 of each (session/provenance.py)."""
    return {
        "version": __version__,
        "session": session.name,
        "recorded": recorded_on(session),
        "digest": digest(session),
        "files": dict(files),
    }


def _parts(value: object) -> Iterator[bytes]:
    if is_dataclass(value):
        for field in fields(value):
            if field.name not in _ASIDE:
                yield field.name.encode()
                yield from _parts(getattr(value, field.name))
    elif isinstance(value, np.ndarray):
        yield str(value.shape).encode()
        yield np.ascontiguousarray(value, dtype="<f8").tobytes()
    elif isinstance(value, Mapping):
        for key in sorted(value, key=str):
            yield str(key).encode()
            yield from _parts(value[key])
    elif isinstance(value, (tuple, list)):
        for item in value:
            yield from _parts(item)
    else:
        yield repr(value.item() if isinstance(value, np.generic) else value).encode()
