"""Parameters that say what the next recording or window is; recorder and identifier share them."""

from __future__ import annotations

import numpy as np

from rig_identification.errors import InputError
from rig_identification.nodes.parameters import OwnParameter, OwnParameters, check_value, one_of, within
from rig_identification.nodes.session_folder import RecordingPlan
from rig_identification.recording import Dummy

RECORDING = (
    OwnParameter("recording.name", "", "its folder; empty: static_1, run_1, ... by count", settable=True),
    OwnParameter(
        "recording.kind", "dynamic", "static or dynamic", one_of("static", "dynamic"), settable=True
    ),
    OwnParameter("recording.holdout", False, "only scores the fit", settable=True),
    OwnParameter(
        "recording.dummy_mass", 0.0, "kg of a known mass on the body; 0: none", within(0, 1e6), True
    ),
    OwnParameter("recording.dummy_position", [0.0, 0.0, 0.0], "m, body frame", within(-100, 100, "m"), True),
)
#: Words and numbers that a request may give as these parameters do.
_CHECKED = {p.name: p for p in RECORDING}
_STEM = {"static": "static", "dynamic": "run"}


def planned(own: OwnParameters, taken: set[str]) -> RecordingPlan:
    """The recording that the parameters describe; ``taken``: names in use. Raises InputError."""
    kind = own.text("recording.kind")
    name = own.text("recording.name") or _next_name(kind, taken)
    mass = own.number("recording.dummy_mass")
    dummy = (
        Dummy(mass, own.vector("recording.dummy_position", 3)) if mass > 0.0 and kind == "static" else None
    )
    return RecordingPlan(name, kind, own.flag("recording.holdout") and kind == "dynamic", dummy)


def plan_of(
    name: str, kind: str, holdout: bool, dummy_mass: float, dummy_position: list[float], taken: set[str]
) -> RecordingPlan:
    """The recording of one request. What does not belong together is refused here, not left aside.

    Raises InputError.
    """
    given = {"kind": kind, "dummy_mass": dummy_mass, "dummy_position": dummy_position}
    for key, value in given.items():
        try:
            check_value(_CHECKED[f"recording.{key}"], value)
        except ValueError as error:
            raise InputError(f"{key}: {error}") from error
    dummy = Dummy(dummy_mass, np.array(dummy_position)) if dummy_mass > 0.0 else None
    return RecordingPlan(name or _next_name(kind, taken), kind, holdout, dummy)


def _next_name(kind: str, taken: set[str]) -> str:
    number = 1
    while f"{_STEM[kind]}_{number}" in taken:
        number += 1
    return f"{_STEM[kind]}_{number}"
