"""Parameters that say what the next recording or window is; recorder and identifier share them."""

from __future__ import annotations

from rig_identification.nodes.parameters import OwnParameter, OwnParameters, one_of, within
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
_STEM = {"static": "static", "dynamic": "run"}


def planned(own: OwnParameters, taken: set[str]) -> RecordingPlan:
    """The recording that the parameters describe; ``taken``: names in use. Raises InputError."""
    kind = own.text("recording.kind")
    name = own.text("recording.name")
    if not name:
        number = 1
        while f"{_STEM[kind]}_{number}" in taken:
            number += 1
        name = f"{_STEM[kind]}_{number}"
    mass = own.number("recording.dummy_mass")
    dummy = (
        Dummy(mass, own.vector("recording.dummy_position", 3)) if mass > 0.0 and kind == "static" else None
    )
    return RecordingPlan(name, kind, own.flag("recording.holdout") and kind == "dynamic", dummy)
