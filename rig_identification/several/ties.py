"""Which doubts of several sessions are the same number, and how far it stays the same between them.

A doubt p of a session, in units of its tolerance, is p = a s + b f: s is what all sessions of one rig share,
f is new in each; both are N(0, 1), and a^2 + b^2 = 1.

- What is bolted or is a property of a device stays: hinges, lengths, level, mounts, gains and scales.
  b is ``NEW``: a lab states a tolerance to about one digit, so a tenth of it is not part of what it knows.
- What starts anew with each session has a = 0: zeros and biases (devices are switched on and zeroed),
  clocks, the tracker's place in the room, and what was found in one session alone.

Two doubts are one number if rig, name, unit, description and tolerance are the same: a hinge in another pose
is another point of the body, and a device that was mounted elsewhere was mounted anew.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from rig_identification.joint import Doubt, JointInformation
from rig_identification.several.session_result import SessionResult

Array = NDArray[np.float64]

#: Std of what is new in each session of a number that stays, in units of its tolerance.
NEW = 0.1
#: Kinds of doubts (their names less device and axis) that stay from session to session.
STAYING = frozenset(
    [
        *("ceiling_point", "body_point", "length", "level", "position", "orientation"),
        *("marker_position", "marker_orientation", "gain", "load_cell_gain"),
        *("gyroscope_scale", "accelerometer_scale"),
    ]
)
#: Kinds that are new where a device is mounted anew.
OF_MOUNT = frozenset(("position", "orientation", "marker_position", "marker_orientation"))
#: Kinds that belong to the rig and not to a device that can be carried to another one.
OF_RIG = frozenset(("ceiling_point", "body_point", "length", "level"))
#: m: a hinge of two descriptions is one hinge if its points differ by no more than two surveys of it may:
#: three times sqrt(2) tolerances a coordinate.
SURVEYS = 3.0 * np.sqrt(2.0)
#: Of what a description tells, beside the cables. What was found in one session alone ties no others.
DESCRIBED = ("level", "imu", "inclinometer", "exciter", "mocap")
#: Digits behind the point to which descriptions are compared: a nanometre is rounding.
DIGITS = 9


@dataclass(frozen=True)
class Sharing:
    """What a lab says of its sessions beyond their descriptions. Patterns are those of file names."""

    rigs: tuple[str, ...] = ()  # rig of each session; empty: told by the ceiling points
    fresh: tuple[str, ...] = ()  # doubts that are new in each session
    kept: tuple[str, ...] = ()  # doubts that stay from session to session
    carried: tuple[str, ...] = ()  # devices that go from rig to rig
    new: float = NEW  # see above


@dataclass(frozen=True)
class Ties:
    """For each session and each of its doubts: which shared number it is, and how much of it."""

    keys: tuple[tuple[Hashable, ...], ...]
    shared: tuple[Array, ...]  # (K,) a of each doubt
    rigs: tuple[str, ...]  # of each session

    def correlation(self, i: int, j: int) -> Array:
        """(K_i, K_j) prior correlation of the doubts of two sessions."""
        place = {key: column for column, key in enumerate(self.keys[j])}
        out = np.zeros((len(self.keys[i]), len(self.keys[j])))
        for row, key in enumerate(self.keys[i]):
            column = place.get(key)
            if column is not None:
                out[row, column] = self.shared[i][row] * self.shared[j][column]
        return out


def ties(results: Sequence[SessionResult], sharing: Sharing | None = None) -> Ties:
    """Find what sessions share. Sessions without joint information share nothing that is known."""
    said = sharing or Sharing()
    rigs = said.rigs or _rigs(results)
    keys, shared = [], []
    for result, rig in zip(results, rigs, strict=True):
        doubts = () if result.joint is None else result.joint.doubts
        keys.append(tuple(_key(d, rig, result.joint, said) for d in doubts))
        described = (*DESCRIBED, *(() if result.joint is None else result.joint.ceiling))
        shared.append(np.array([_share(d, said, described) for d in doubts]))
    return Ties(tuple(keys), tuple(shared), tuple(rigs))


def _share(doubt: Doubt, said: Sharing, described: Sequence[str]) -> float:
    """a of a doubt."""
    if _matches(doubt.name, said.fresh) or doubt.name.partition(".")[0] not in described:
        return 0.0
    stays = _matches(doubt.name, said.kept) or _kind(doubt.name) in STAYING
    return float(np.sqrt(1.0 - said.new**2)) if stays else 0.0


def _key(doubt: Doubt, rig: str, joint: JointInformation | None, said: Sharing) -> Hashable:
    device, kind = doubt.name.partition(".")[0], _kind(doubt.name)
    mount = None if joint is None or kind not in OF_MOUNT else joint.mounts.get(device)
    place = None if mount is None else tuple(np.round(mount, DIGITS).tolist())
    anywhere = device in said.carried and kind not in OF_RIG
    stated = (doubt.unit, round(doubt.nominal, DIGITS), doubt.prior_std)
    return ("" if anywhere else rig, doubt.name, stated, place)


def name_of(key: Hashable) -> str:
    """Name of the doubt that a key of :class:`Ties` stands for."""
    assert isinstance(key, tuple)
    return str(key[1])


def _kind(name: str) -> str:
    """``ceiling_point`` of ``cable_1.ceiling_point.x``, ``length`` of ``cable_1.length``."""
    parts = name.split(".")
    if parts[0] == "level":
        return "level"
    return parts[1] if len(parts) > 1 else name


def _matches(name: str, patterns: Sequence[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _rigs(results: Sequence[SessionResult]) -> tuple[str, ...]:
    """Name of each session's rig: one rig if the cables' ceiling points are the same within two surveys."""
    known: list[JointInformation] = []
    out = []
    for result in results:
        joint = result.joint
        if joint is None:
            out.append("unknown")
            continue
        found = next((i for i, other in enumerate(known) if _one_rig(joint, other)), None)
        if found is None:
            found = len(known)
            known.append(joint)
        out.append(f"rig {found + 1}")
    return tuple(out)


def _one_rig(one: JointInformation, other: JointInformation) -> bool:
    if set(one.ceiling) != set(other.ceiling):
        return False
    off = [np.max(np.abs(point - other.ceiling[cable])) for cable, point in one.ceiling.items()]
    hinges = [d.prior_std for d in (*one.doubts, *other.doubts) if _kind(d.name) == "ceiling_point"]
    return bool(max(off, default=np.inf) <= SURVEYS * max(hinges, default=10.0**-DIGITS))
