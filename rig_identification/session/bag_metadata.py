"""``metadata.yaml`` of a rosbag2 folder: a hint at what belongs to the bag, never a condition.

Versions 1 to 9 name what is used here alike; a newer one is tried.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from ruamel.yaml.error import YAMLError

from rig_identification.session.fields import one_line
from rig_identification.session.yaml_text import TooMuch, load_yaml, read_text

NAME = "metadata.yaml"
_NEWEST = 9


@dataclass(frozen=True)
class BagMetadata:
    """What a bag says of itself."""

    storage: str | None  # "mcap", "sqlite3" or whatever else a plugin is called; None: it does not say
    files: tuple[str, ...]  # names inside the folder, in order
    topics: dict[str, str]  # topic -> message type
    messages: int  # of all topics
    notes: tuple[str, ...] = ()


def read_bag_metadata(folder: Path) -> BagMetadata:
    """Read the metadata of the bag in ``folder``; one that is missing or wrong is empty and says so."""
    file = folder / NAME
    if not file.is_file():
        return _nothing("is missing")
    try:
        document: Any = load_yaml(read_text(file))
        return _metadata(document["rosbag2_bagfile_information"])
    except (YAMLError, TooMuch, OSError, UnicodeDecodeError) as err:
        return _nothing(f"cannot be read ({one_line(getattr(err, 'problem', None) or err)})")
    except (KeyError, TypeError, ValueError, AttributeError) as err:
        return _nothing(f"does not say what it should ({one_line(err)})")


def _nothing(problem: str) -> BagMetadata:
    return BagMetadata(None, (), {}, 0, (f"{NAME} {problem}: the bag's files were read as they are",))


def _metadata(given: dict[str, Any]) -> BagMetadata:
    version = int(given.get("version", _NEWEST))
    notes: tuple[str, ...] = ()
    if version > _NEWEST:
        notes = (f"{NAME} is of version {version}, newer than {_NEWEST}: read as if it were {_NEWEST}",)
    listed = [item["topic_metadata"] | item for item in given["topics_with_message_count"] or []]
    return BagMetadata(
        storage=str(given.get("storage_identifier") or ""),
        files=tuple(PurePath(str(path)).name for path in given["relative_file_paths"]),
        topics={str(item["name"]): str(item["type"]) for item in listed},
        messages=sum(int(item["message_count"]) for item in listed),
        notes=notes,
    )
