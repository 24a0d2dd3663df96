"""What a column can be: words such as ``imu.angular_rate.z``, and where each goes in a recording."""

from __future__ import annotations

import re
from dataclasses import dataclass

from rig_identification.errors import did_you_mean
from rig_identification.topics import DEVICES

_AXES = "xyz"


@dataclass(frozen=True)
class Quantity:
    """One number of a device."""

    word: str
    channel: str  # field of Recording
    part: str  # of the channel: "0" to "6", its column; "roll", "pitch", "yaw" of a pose
    unit: str  # SI
    cable: str | None = None


#: Word -> quantity, of every device but the cables.
FIXED = {
    quantity.word: quantity
    for quantity in (
        *(Quantity(f"imu.angular_rate.{a}", "imu", str(i), "rad/s") for i, a in enumerate(_AXES)),
        *(Quantity(f"imu.specific_force.{a}", "imu", str(3 + i), "m/s^2") for i, a in enumerate(_AXES)),
        *(Quantity(f"mocap.position.{a}", "mocap", str(i), "m") for i, a in enumerate(_AXES)),
        *(Quantity(f"mocap.quaternion.{a}", "mocap", str(3 + i), "1") for i, a in enumerate("xyzw")),
        *(Quantity(f"mocap.{turn}", "mocap", turn, "rad") for turn in ("roll", "pitch", "yaw")),
        *(Quantity(f"inclinometer.{a}", "inclination", str(i), "rad") for i, a in enumerate("xy")),
        *(Quantity(f"exciter.force.{a}", "exciter_force", str(i), "N") for i, a in enumerate(_AXES)),
        Quantity("exciter.angle", "exciter_shaft", "0", "rad"),
        Quantity("exciter.rate", "exciter_shaft", "1", "rad/s"),
    )
}
#: Columns of each channel.
WIDTH = {"imu": 6, "mocap": 7, "inclination": 2, "exciter_force": 3, "exciter_shaft": 2, "tension": 1}
_CABLE = re.compile(r"[A-Za-z]\w*")


def quantity(word: str) -> Quantity | None:
    """The quantity that a word names; ``left.tension`` is that of the cable ``left``."""
    if word in FIXED:
        return FIXED[word]
    cable, dot, what = word.rpartition(".")
    if dot and what == "tension" and _CABLE.fullmatch(cable) and cable not in DEVICES:
        return Quantity(word, "tension", "0", "N", cable)
    return None


def unknown(word: str) -> str:
    """What is wrong with a word that names no quantity."""
    return (
        f"{word!r} is unknown; give one of {', '.join(FIXED)}, or CABLE.tension with a cable's name"
        f"{did_you_mean(word, FIXED)}"
    )
