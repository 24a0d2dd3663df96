"""Whether the body hung at rest during a static recording, from the signals themselves."""

from __future__ import annotations

from rig_identification.recording import Recording
from rig_identification.rig import Rig


def check_rest(recording: Recording, rig: Rig, where: str) -> None:
    """Nothing yet."""
