"""A session.yaml for bags that have none, for a person to edit: nothing is written anywhere."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from ruamel.yaml import YAML

from rig_identification.cleaning.rest import first_motion
from rig_identification.errors import InputError
from rig_identification.recording import Recording
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.session.bag import read_bag
from rig_identification.session.not_a_session import FILE, bags_in
from rig_identification.session.rig_description import read_rig
from rig_identification.session.yaml_text import beginning_of
from rig_identification.topics import foreign_cable

#: Reads and cleans one bag as a dynamic run of a rig.
ReadRun = Callable[[Path, Rig], Recording]
#: Where no rig description says it.
_GRAVITY = 9.80665  # m/s^2
_DUMMY = "with a known mass fixed to it? then add dummy: {mass: 50.0, position: [x, y, z]}"


@dataclass(frozen=True)
class _Judged:
    """One bag and what it is taken for."""

    bag: str  # as session.yaml names it
    start_ns: int  # of its first stamp
    motion: str | None  # what moves; None: at rest
    refusal: str = ""  # why it cannot be used
    seconds: float = 0.0


def propose(folder: Path, namespace: str, read_run: ReadRun, progress: Callable[[str], None] | None) -> str:
    """Text of a session.yaml for the bags in ``folder``.

    A bag in which nothing moves, by the measure of static recordings, is proposed as static. The last of the
    others is proposed to be held out, if one is left to fit.
    """
    bags = bags_in(folder)
    rig_file, others = _rig_files(folder)
    rig = read_rig(rig_file) if rig_file else _stand_in(bags, namespace)
    lines = [f"# A proposal: edit it and save it as {folder / FILE}", _rig_line(folder, rig_file, others)]
    return "\n".join([*lines, *recordings_lines(folder, bags, rig, read_run, progress)]) + "\n"


def recordings_lines(
    folder: Path, bags: list[Path], rig: Rig, read_run: ReadRun, progress: Callable[[str], None] | None
) -> list[str]:
    """The list of recordings of a session.yaml in ``folder``, a line a bag."""
    judged = []
    for bag in bags:
        name = bag.relative_to(folder).as_posix()
        if progress is not None:
            progress(f"reading {name}")
        judged.append(_judged(bag, name, rig, read_run))
    judged.sort(key=lambda one: (bool(one.refusal), one.start_ns))
    moving = [one for one in judged if one.motion is not None and not one.refusal]
    held_out = moving[-1] if len(moving) > 1 else None
    return ["recordings:", *(_line(one, one is held_out) for one in judged)]


def _rig_files(folder: Path) -> tuple[Path | None, list[Path]]:
    """The first YAML file in the folder that is a rig description, and those that look like one."""
    alike = [
        file for file in sorted(folder.glob("*.y*ml")) if "ros__parameters" in beginning_of(file, 1 << 16)
    ]
    for file in alike:
        try:
            read_rig(file)
        except InputError:
            continue
        return file, [other for other in alike if other != file]
    return None, alike


def _rig_line(folder: Path, file: Path | None, others: list[Path]) -> str:
    names = ", ".join(other.name for other in others)
    if file is not None:
        return f"rig: {_quoted(file.name)}" + (f"  # or {names}" if names else "")
    if others:
        fault = ""
        try:
            read_rig(others[0])
        except InputError as err:
            fault = str(err)
        return f"rig: {_quoted(others[0].name)}  # to be mended: {fault}"
    return "rig: rig.yaml  # to be written: a rig description as in the recording contract"


def _stand_in(bags: list[Path], namespace: str) -> Rig:
    """A rig of every device and of the cables that the bags name: enough to tell motion from rest."""
    names: dict[str, None] = {}
    for bag in bags:
        try:
            listed = read_bag(bag, ()).listed
        except InputError:
            continue
        names |= dict.fromkeys(filter(None, (foreign_cable(topic, namespace) for topic in listed)))
    origin, upright = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    mount = Mount(origin, upright)
    cables = tuple(Cable(name, origin, origin, 1.0, "ceiling") for name in names or ["cable_1"])
    return Rig(_GRAVITY, cables, imu=mount, inclinometer=mount, exciter=mount)


def _judged(bag: Path, name: str, rig: Rig, read_run: ReadRun) -> _Judged:
    try:
        recording = read_run(bag, rig)
    except InputError as err:
        return _Judged(name, 0, "", str(err))
    return _Judged(name, recording.start_ns, first_motion(recording, rig), seconds=recording.duration)


def _line(one: _Judged, held_out: bool) -> str:
    bag = _quoted(one.bag)
    if one.refusal:
        return f"# - {{bag: {bag}, kind: dynamic}}  # cannot be used: {one.refusal}"
    if one.motion is None:
        return f"  - {{bag: {bag}, kind: static}}  # {one.seconds:.1f} s at rest; {_DUMMY}"
    role = ", holdout: true" if held_out else ""
    only = "only scores the fit; " if held_out else ""
    return f"  - {{bag: {bag}, kind: dynamic{role}}}  # {one.seconds:.1f} s; {only}{one.motion}"


def _quoted(name: str) -> str:
    """``name`` as YAML in a list in braces reads it back."""
    try:
        plain = YAML(typ="safe", pure=True).load(f"{{bag: {name}}}")
    except Exception:  # a name may hold anything
        plain = None
    return name if plain == {"bag": name} else json.dumps(name, ensure_ascii=False)
