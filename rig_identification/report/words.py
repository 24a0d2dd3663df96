"""Names of the code and of the recording contract as a person reads them."""

from __future__ import annotations

import re

_ACRONYMS = {"imu": "IMU", "mocap": "motion capture"}
#: Parameters whose names in the code say nothing to a person.
_PARAMETERS = {
    "held_xx": "stiffness of the upper end along world x",
    "held_xy": "stiffness of the upper end between world x and y",
    "held_yy": "stiffness of the upper end along world y",
    "plates_x": "drag area across x",
    "plates_y": "drag area across y",
    "plates_z": "drag area across z",
    "twisted_x": "moment of the clamped cables about x",
    "twisted_y": "moment of the clamped cables about y",
    "twisted_z": "moment of the clamped cables about z",
}


def words(name: str) -> str:
    """``imu_bias`` as "IMU bias"."""
    return " ".join(_ACRONYMS.get(word, word) for word in re.split(r"[_.\s]+", name) if word)


def device_words(name: str) -> str:
    """A device as it is called; a cable keeps the name that the rig description gives it."""
    return _ACRONYMS.get(name, name)


def title(name: str) -> str:
    """:func:`words` that begin with a capital; what follows stays as it is."""
    text = words(name)
    return text[:1].upper() + text[1:]


def parameter_words(name: str) -> str:
    """A parameter's name without its device: ``load_cell_gain`` as "load cell gain"."""
    return _PARAMETERS.get(name) or words(name)
