"""``session.yaml``: which bags belong to a session and what each of them is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rig_identification.errors import InputError
from rig_identification.recording import Dummy
from rig_identification.session.fields import Fields, load_fields
from rig_identification.session.not_a_session import check_description, description_file
from rig_identification.session.rig_description import LARGEST_LENGTH, LENGTH_HINT

_KEYS = ("bag", "kind", "holdout", "dummy")


@dataclass(frozen=True)
class BagEntry:
    """One line of the list of recordings."""

    name: str  # as written in session.yaml
    folder: Path
    kind: str  # "static" or "dynamic"
    holdout: bool
    dummy: Dummy | None


@dataclass(frozen=True)
class SessionDescription:
    """Content of a session.yaml, paths resolved against its folder."""

    file: Path
    rig_file: Path
    entries: tuple[BagEntry, ...]


def read_session_description(path: Path) -> SessionDescription:
    """Read ``path``: a session's folder or its session.yaml.

    Raises
    ------
    MissingDescription
        A folder of bags without a session.yaml.
    InputError
        The first fault, as one line with file, key path, value and what to do.
    """
    file = description_file(path)
    top = load_fields(file, "session description")
    check_description(top)
    top.refuse_misspelt(("rig", "recordings"))
    rig = top.require("rig", "the rig description's path")
    listed = top.require("recordings", "the list of bags")
    if not isinstance(rig, str):
        raise top.fault("rig", f"{rig!r} is not a path")
    if not isinstance(listed, list) or not listed:
        raise top.fault("recordings", "is not a list of bags; give at least one {bag: ..., kind: ...}")
    entries = tuple(_entry(file, index, item) for index, item in enumerate(listed))
    _check_together(top, entries)
    return SessionDescription(file, file.parent / rig, entries)


def _entry(file: Path, index: int, item: object) -> BagEntry:
    where = f"recordings[{index}]"
    if not isinstance(item, dict):
        raise InputError(f"{file}: {where}: {item!r} is not a mapping; give {{bag: ..., kind: ...}}")
    fields = Fields(file, where, item)
    fields.refuse_unknown(_KEYS)
    bag = fields.require("bag", "the bag's folder")
    if not isinstance(bag, str):
        raise fields.fault("bag", f"{bag!r} is not a path")
    fields.require("kind", "static or dynamic")
    kind = fields.choice("kind", ("static", "dynamic"))
    holdout = fields.values.get("holdout", False)
    if not isinstance(holdout, bool):
        raise fields.fault("holdout", f"{holdout!r} is unknown; give true or false")
    if kind == "static" and holdout:
        raise fields.fault(
            "holdout", "a static recording cannot be held out; remove holdout or make it dynamic"
        )
    if kind == "dynamic" and fields.has("dummy"):
        raise fields.fault("dummy", "belongs to a static recording; remove it or make the recording static")
    return BagEntry(bag, file.parent / bag, kind, holdout, _dummy(fields) if fields.has("dummy") else None)


def _dummy(fields: Fields) -> Dummy:
    dummy = fields.section("dummy", "mass and position of the known mass")
    dummy.refuse_unknown(("mass", "position"))
    return Dummy(
        mass=dummy.number("mass", "kg", above=0.0),
        position=dummy.vector("position", 3, "m", limit=LARGEST_LENGTH, hint=LENGTH_HINT),
    )


def _check_together(top: Fields, entries: tuple[BagEntry, ...]) -> None:
    seen: set[Path] = set()
    for index, entry in enumerate(entries):
        if entry.folder.resolve() in seen:
            raise top.fault(f"recordings[{index}].bag", f"{entry.name} is listed twice; list each bag once")
        seen.add(entry.folder.resolve())
    if all(entry.holdout for entry in entries):
        raise top.fault("recordings", "every recording is held out; leave at least one to fit")
