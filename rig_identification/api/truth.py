"""A simulated session on disk: its bags, and beside them what is true of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.api.effects import effects_document
from rig_identification.errors import InputError

if TYPE_CHECKING:
    from rig_identification.recording import Session
    from rig_identification.simulate import Truth

TRUTH = "truth.json"


def write_simulated(session: Session, truth: Truth, folder: Path, **options: Any) -> None:
    """The session as bags, and what is true of it as ``truth.json``. options: of ``write_session``.

    Raises
    ------
    InputError
        The folder exists or cannot be written to.
    """
    from rig_identification.session import write_session

    try:
        write_session(session, folder, **options)
        (folder / TRUTH).write_text(json.dumps(truth_document(truth), indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{folder}: {reason}; name another folder") from error


def truth_document(truth: Truth) -> dict[str, Any]:
    """Truth in the words of the result."""
    from rig_identification.model.body import tensor

    return {
        "mass": float(truth.elements[0]),
        "center_of_mass": truth.elements[1:4].tolist(),
        "inertia": tensor(truth.elements[4:]).tolist(),
        "effects": effects_document(truth.effects),
        "parameters": {
            # Of a lag or a law that an effect switches on, no description says anything: it has none
            name: {"value": value, "described": truth.described.get(name, 0.0)}
            for name, value in truth.parameters.items()
        },
        "least_tension": truth.least_tension,
    }
