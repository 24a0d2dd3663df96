"""The tables of the thesis as they are printed, and a fingerprint of the numbers as typed.

Each file holds what is printed (``printed``, ``published``), what had to be decided to make
sense of it (``reading``) and why, with every inconsistency found (``remarks``). Only the
first two are numbers of the thesis, and only they enter the fingerprint.
"""

from __future__ import annotations

import hashlib
import json
from importlib import resources
from typing import Any

from ruamel.yaml import YAML

from rig_identification.errors import InputError

CASE_NUMBERS = tuple(range(1, 19))


def _read(name: str) -> dict[str, Any]:
    folder = resources.files("rig_identification.thesis") / "tables"
    text = (folder / name).read_text(encoding="utf-8")
    table: dict[str, Any] = YAML(typ="safe", pure=True).load(text)
    return table


def read_case_table(number: int) -> dict[str, Any]:
    """Return the printed data of one case study (Kutluay, chapter 4).

    Units are SI but for the names printed otherwise; positions are in metres. Raises
    ``InputError`` for a number that the thesis does not have.
    """
    if number not in CASE_NUMBERS:
        raise InputError(f"case study {number}: the thesis has cases 1 to 18; name one of them")
    return _read(f"case_{number:02d}.yaml")


def read_static_table() -> dict[str, Any]:
    """Return Table 2.1, the case study of chapter 2; its units stand in the file's comments."""
    return _read("table_2_1.yaml")


def read_text_remarks() -> tuple[tuple[str, str], ...]:
    """Return (where, remark) for every inconsistency found in the thesis' text and equations."""
    return tuple((entry["where"], entry["remark"].strip()) for entry in _read("text.yaml")["remarks"])


def fingerprint(table: dict[str, Any]) -> str:
    """Return the SHA-256 of the numbers as typed: ``printed`` and ``published``, keys sorted."""
    typed = {key: table[key] for key in ("printed", "published") if key in table}
    canonical = json.dumps(typed, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode("utf-8")).hexdigest()
