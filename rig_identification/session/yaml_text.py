"""YAML of a description, read within limits: whatever the text holds, it costs seconds and megabytes.

The pure loader reads some thousands of nodes a second. An alias stands for all that its anchor holds: a few
lines of aliases of aliases would stand for gigabytes in a message, or where mappings are merged.
"""

from __future__ import annotations

from pathlib import Path

from ruamel.yaml import YAML
from ruamel.yaml.events import (
    AliasEvent,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

#: Bytes. A rig of 64 cables takes 20 kB, a session of a thousand recordings 60 kB, comments as much again.
LARGEST = 1 << 17
#: Nodes, what aliases stand for included. A rig of 64 cables has 1000, a session of a thousand bags 8000.
MOST_NODES = 10_000
#: Levels. The descriptions have six; other tools may add theirs to a file of ROS parameters.
DEEPEST = 20


class TooMuch(ValueError):
    """A text beyond the limits; the message says which, without the file's name."""


def read_text(file: Path, largest: int = LARGEST) -> str:
    """Text of a regular file.

    Raises
    ------
    TooMuch
        The file is larger than ``largest`` bytes, or is no regular file, which might never end.
    OSError, UnicodeDecodeError
        As of ``Path.read_text``.
    """
    size = file.stat().st_size
    if file.exists() and not (file.is_file() or file.is_dir()):
        raise TooMuch("it is a device or a pipe; give a file")
    if size > largest and file.is_file():
        raise TooMuch(f"{size} bytes are more than the {largest} that such a file may have")
    return file.read_text(encoding="utf-8")


def beginning_of(file: Path, size: int) -> str:
    """The first ``size`` bytes of a file as far as they are text; "" for what cannot be read or is no file.

    A pipe or a device might never end, and a link to itself leads nowhere.
    """
    if not file.is_file():
        return ""
    try:
        with file.open("rb") as stream:
            return stream.read(size).decode("utf-8", errors="replace")
    except OSError:
        return ""


def load_yaml(text: str) -> object:
    """Content of a YAML 1.2 document.

    Raises
    ------
    TooMuch
        It is nested too deeply or holds too many nodes, aliases counted as what they stand for.
    YAMLError, ValueError
        It is no YAML.
    """
    _check_extent(text)
    # The pure loader is YAML 1.2: 1e-3 is a number, and a key given twice is a fault.
    return YAML(typ="safe", pure=True).load(text)


def _check_extent(text: str) -> None:
    """Raise TooMuch for a document beyond the limits, as soon as it is."""
    nodes = 0
    named: set[str] = set()
    sizes: dict[str | None, int] = {}  # anchor -> nodes that it holds, once it is complete
    above: list[tuple[str | None, int]] = []  # anchor, and nodes before it, of each open mapping and list
    for event in YAML(typ="safe", pure=True).parse(text):
        line = event.start_mark.line + 1
        anchor = getattr(event, "anchor", None)
        if isinstance(event, AliasEvent):
            if anchor not in sizes:
                raise TooMuch(f"line {line}: *{anchor} stands inside what it names; write it out")
            nodes += sizes[anchor]
        elif anchor in named:
            raise TooMuch(f"line {line}: the anchor &{anchor} is given twice; rename one")
        elif isinstance(event, NodeEvent):
            nodes += 1
        if isinstance(event, (MappingStartEvent, SequenceStartEvent)):
            above.append((anchor, nodes - 1))
        elif isinstance(event, (MappingEndEvent, SequenceEndEvent)):
            name, before = above.pop()
            sizes[name] = nodes - before
        elif isinstance(event, ScalarEvent):
            sizes[anchor] = 1
        if anchor is not None:
            named.add(anchor)
        if len(above) > DEEPEST:
            raise TooMuch(f"line {line}: is nested deeper than {DEEPEST} levels")
        if nodes > MOST_NODES:
            raise TooMuch(
                f"line {line}: holds more than {MOST_NODES} values, or stands for as many by its aliases"
            )
