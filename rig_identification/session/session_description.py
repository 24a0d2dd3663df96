"""``session.yaml``: which bags belong to a session and what each of them is."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

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
    top = load_fields(description_file(path), "session description")
    check_description(top)
    return session_from_fields(top)


def session_from_fields(top: Fields) -> SessionDescription:
    """Validate the content of a session.yaml, wherever it was read. Raises InputError."""
    top.refuse_misspelt(("rig", "recordings"))
    rig = top.text("rig", "the rig description's path", "path")
    entries = tuple(map(_entry, top.entries("recordings", "a list of bags", "{bag: ..., kind: ...}")))
    _check_together(top, entries)
    return SessionDescription(top.file, top.file.parent / rig, entries)


def _entry(fields: Fields) -> BagEntry:
    fields.refuse_unknown(_KEYS)
    bag = fields.text("bag", "the bag's folder", "path")
    fields.require("kind", "static or dynamic")
    kind = fields.choice("kind", ("static", "dynamic"))
    holdout = fields.flag("holdout")
    if kind == "static" and holdout:
        raise fields.fault(
            "holdout", "a static recording cannot be held out; remove holdout or make it dynamic"
        )
    if kind == "dynamic" and fields.has("dummy"):
        raise fields.fault("dummy", "belongs to a static recording; remove it or make the recording static")
    folder = fields.file.parent / bag
    return BagEntry(bag, folder, kind, holdout, _dummy(fields) if fields.has("dummy") else None)


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
