"""The first rig.yaml and session.yaml of a lab: what its bags hold, what it measured, and comments."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rig_identification.errors import InputError
from rig_identification.rig import DEFAULT_TOLERANCE, Vector
from rig_identification.session import described
from rig_identification.session.bag import Bag, read_bag
from rig_identification.session.proposal import ReadRun, recordings_lines
from rig_identification.session.rig_description import read_rig
from rig_identification.session.schema import SCHEMAS
from rig_identification.topics import FIXED_TOPICS, expected_topics, foreign_cable

RIG_FILE = "rig.yaml"
#: Folder of the schemas beside the files; hidden, so that nobody takes it for a bag.
SCHEMA_FOLDER = ".schema"
#: Devices that are mounted on the body, by the channel of their topic.
MOUNTED = {
    "imu": "imu",
    "inclination": "inclinometer",
    "exciter_force": "exciter",
    "exciter_shaft": "exciter",
    "mocap": "mocap",
}
_LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Held:
    """What the bags of a folder hold of the contract."""

    topics: dict[str, tuple[str, int]]  # every topic -> its type and its messages in all bags
    used: frozenset[str]  # topics of the contract, or mapped to one
    cables: tuple[str, ...]
    devices: tuple[str, ...]  # of MOUNTED


@dataclass(frozen=True)
class CableAnswer:
    """Where one cable hangs, in m."""

    name: str
    ceiling_point: Vector
    body_point: Vector
    length: float


@dataclass(frozen=True)
class Answers:
    """What the lab knows of its rig: SI units."""

    gravity: float
    mass: float | None
    mass_std: float | None
    cables: tuple[CableAnswer, ...]
    positions: Mapping[str, Vector] = field(default_factory=dict)  # device -> (3,) m, body


def held_by(bags: Sequence[Path], namespace: str, topics: Mapping[str, str]) -> Held:
    """List the topics of bags, and find the devices that they are of.

    Raises
    ------
    InputError
        A bag cannot be read, or ``topics`` has a key that is no topic of a rig.
    """
    read = [read_bag(bag, ()) for bag in bags]
    counted: dict[str, tuple[str, int]] = {}
    for bag in read:
        for name, kind in bag.listed.items():
            counted[name] = (kind, counted.get(name, (kind, 0))[1] + bag.counts[name])
    cables = _cables(read, namespace, topics)
    expected = expected_topics(cables, namespace, topics)
    used = {name: topic for name, topic in expected.items() if name in counted}
    found = {MOUNTED[topic.channel] for topic in used.values() if topic.channel in MOUNTED}
    recorded = tuple(topic.cable for topic in used.values() if topic.cable is not None)
    devices = tuple(dict.fromkeys(device for device in MOUNTED.values() if device in found))
    return Held(counted, frozenset(used), recorded, devices)


def _cables(bags: Sequence[Bag], namespace: str, topics: Mapping[str, str]) -> tuple[str, ...]:
    """Cables by the form of the topics' names, and those that are mapped."""
    named = [foreign_cable(topic, namespace) for bag in bags for topic in bag.listed]
    mapped = [key.strip("/").removesuffix("/wrench") for key in topics if key.strip("/") not in FIXED_TOPICS]
    return tuple(sorted(dict.fromkeys(filter(None, [*named, *mapped]))))


def rig_text(answers: Answers) -> str:
    """A rig description with a comment to each key."""
    words = described.RIG
    lines = [
        _editor_line("rig"),
        "# The rig as you believe it to be; the tool finds out where it is wrong. In m, kg, s, N, rad.",
        "# world: fixed to the room, z up. body: fixed to the body, from a point that a tape reaches.",
        "/**:",
        "  ros__parameters:",
        _line(2, "gravity", answers.gravity, f"m/s^2. {words['gravity']}"),
        _line(2, "mass", answers.mass, f"kg. {words['mass']}", example=10.0),
        _line(2, "mass_std", answers.mass_std, f"kg. {words['mass_std']}", example=0.005),
        _line(2, "cable_linear_density", None, f"kg/m. {words['cable_linear_density']}", example=0.02),
        f"    cables: [{', '.join(_quoted(cable.name) for cable in answers.cables)}]",
    ]
    for number, cable in enumerate(answers.cables):
        lines += _cable_lines(cable, commented=number == 0)
    for device in dict.fromkeys(MOUNTED.values()):
        lines += _mount_lines(device, answers.positions.get(device))
    lines += _tail()
    return "\n".join(lines) + "\n"


def session_text(
    folder: Path, bags: Sequence[Path], rig_file: Path, read_run: ReadRun, namespace: str
) -> str:
    """A session description in ``folder``: which bags there are, and which of them move."""
    lines = [
        _editor_line("session"),
        f"# {described.SESSION['recordings']}",
        f"# {described.SESSION['recordings.kind']}",
        f"# holdout: {described.SESSION['recordings.holdout']}",
        f"rig: {RIG_FILE}",
        *recordings_lines(folder, list(bags), read_rig(rig_file), read_run, None),
    ]
    if not any(line.startswith("  - ") for line in lines):
        raise InputError(f"{folder}: no bag can be used: {lines[-1].partition('cannot be used: ')[2]}")
    return "\n".join(lines) + "\n"


def schema_files() -> dict[str, str]:
    """Name -> text of each schema."""
    return {f"{name}.json": json.dumps(make(), indent=1) + "\n" for name, make in SCHEMAS.items()}


def _editor_line(name: str) -> str:
    """The line by which editors with a YAML language server complete and check the file."""
    return f"# yaml-language-server: $schema={SCHEMA_FOLDER}/{name}.json"


def _line(depth: int, key: str, value: float | None, comment: str, example: float | None = None) -> str:
    if value is None:
        return f"{'  ' * depth}# {key}: {example}  # {comment}"
    return f"{'  ' * depth}{key}: {_number(value)}  # {comment}"


def _cable_lines(cable: CableAnswer, *, commented: bool) -> list[str]:
    """One cable; the first one says what its keys mean."""
    values = {
        "ceiling_point": _vector(cable.ceiling_point),
        "body_point": _vector(cable.body_point),
        "length": _number(cable.length),
        "load_cell": "ceiling",
    }
    units = {"load_cell": ""}
    lines = [f"    {_quoted(cable.name)}:"]
    for key, text in values.items():
        told = f"  # {units.get(key, 'm. ')}{described.RIG[f'CABLE.{key}']}" if commented else ""
        lines.append(f"      {key}: {text}{told}")
    return lines


def _mount_lines(device: str, position: Vector | None) -> list[str]:
    """A device's mount; commented out where it does not record, or where it is estimated."""
    words = described.RIG
    out = "" if position is not None else "# "
    lines = [f"    {out}{device}:  # {words[device]}"]
    if device != "inclinometer":
        shown = np.zeros(3) if position is None else position
        lines.append(f"    {out}  position: {_vector(shown)}  # m. {words[f'{device}.position']}")
    lines.append(f"    {out}  orientation: {_vector(_LEVEL)}  # {words[f'{device}.orientation']}")
    return lines


def _tail() -> list[str]:
    """Noise and tolerances, commented out: what is left out is estimated, or has a default."""
    lines = [f"    # noise:  # {described.RIG['noise']}", "    #   angular_rate: 0.0003"]
    lines.append(f"    # tolerance:  # {described.RIG['tolerance']}")
    return [*lines, *(f"    #   {name}: {_number(value)}" for name, value in DEFAULT_TOLERANCE.items())]


def _vector(values: Vector) -> str:
    return f"[{', '.join(_number(float(value)) for value in values)}]"


def _number(value: float) -> str:
    """Nine digits, as far as a tape measure goes, and a point in every number, as ROS wants it."""
    text = f"{value:.9g}"
    return text if any(sign in text for sign in ".e") else f"{text}.0"


def _quoted(name: str) -> str:
    """A cable's name as YAML reads it back; one such as ``1`` or ``on`` is no text without quotes."""
    return name if name.replace("_", "").isalpha() and len(name) > 3 else json.dumps(name)
