"""A simulated session in the folder that ``--out`` names."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.api.truth import TRUTH, truth_document
from rig_identification.api.truth import write_simulated as write_with_truth
from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.recording import Session
    from rig_identification.simulate import Truth

__all__ = ["TRUTH", "truth_document", "write_simulated"]


def write_simulated(session: Session, truth: Truth, folder: Path, **options: Any) -> None:
    """:func:`rig_identification.api.truth.write_simulated`, whose fault names the option ``--out``."""
    try:
        write_with_truth(session, truth, folder, **options)
    except InputError as error:
        raise InputError(f"--out {error}") from error
