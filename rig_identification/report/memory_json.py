"""``memory.json``: what sessions of one rig taught of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from rig_identification.report.plain import plain
from rig_identification.report.result_json import estimate_part
from rig_identification.result import InertialEstimate
from rig_identification.several.memory import Memory
from rig_identification.several.session_result import SessionResult


def memory_to_dict(memory: Memory) -> dict[str, object]:
    """Each doubt as described and as learned, and what moved in which session."""
    return {
        "sessions": list(memory.sessions),
        "doubts": [
            {
                "name": doubt.name,
                "unit": doubt.unit,
                "described": doubt.nominal,
                "tolerance": doubt.prior_std,
                "value": doubt.nominal + doubt.prior_std * doubt.at,
                "std": doubt.prior_std * float(std),
            }
            for doubt, std in zip(memory.doubts, memory.std, strict=True)
        ],
        "correlation": plain(memory.covariance / np.outer(memory.std, memory.std)),
        "moved": [
            {
                "session": moved.session,
                "part": moved.part,
                "p": moved.p,
                "shift": {name: {"value": v, "std": s} for name, (v, s) in moved.shift.items()},
            }
            for moved in memory.moved
        ],
    }


def write_memory(memory: Memory, path: Path) -> None:
    """Write :func:`memory_to_dict` as strict JSON."""
    _write(memory_to_dict(memory), path)


def write_recalled(
    session: SessionResult, total: InertialEstimate, without_frame: InertialEstimate | None, path: Path
) -> None:
    """Write a session's body with the memory as its prior, in the form of ``result.json``."""
    mismatch = {"verdict": session.verdict, "findings": list(session.findings), "alternatives": []}
    told = {"session": session.name, **estimate_part(total, without_frame), "mismatch": mismatch}
    _write(told, path)


def _write(document: dict[str, object], path: Path) -> None:
    text = json.dumps(plain(document), indent=1, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
