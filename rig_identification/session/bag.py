"""Serialized messages of a bag as it comes, taken in bulk.

rosbags' message iterator makes several Python objects a message, and wants a bag that was closed in order.
So the files are read here, from beginning to end: :mod:`.mcap_storage`, :mod:`.sqlite3_storage` and
:mod:`.rosbag1_storage`. What cannot be read of them is said.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from rig_identification.errors import InputError, did_you_mean
from rig_identification.session.bag_files import BagFiles, bag_files, opened
from rig_identification.session.contents import Contents
from rig_identification.session.fields import one_line
from rig_identification.session.mcap_storage import collect_mcap
from rig_identification.session.raw_topic import RawTopic
from rig_identification.session.rosbag1_storage import collect_rosbag1
from rig_identification.session.sqlite3_storage import collect_sqlite3

_READERS: dict[str, Callable[[Path, Contents], list[str]]] = {
    "mcap": collect_mcap,
    "sqlite3": collect_sqlite3,
    "rosbag1": collect_rosbag1,
}


@dataclass(frozen=True)
class Bag:
    """A bag in memory: what it lists, and the wanted topics' messages."""

    folder: Path  # or the one file that was given
    listed: dict[str, str]  # every topic of the bag -> its message type
    topics: dict[str, RawTopic]
    counts: dict[str, int]  # every topic of the bag -> its messages
    notes: tuple[str, ...] = ()  # sentences on what could not be read, or was read in an uncommon way


def read_bag(path: Path, wanted: Collection[str]) -> Bag:
    """Read the messages of the topics ``wanted`` of the bag at ``path``, a folder or a file of it.

    Raises
    ------
    InputError
        Nothing there, a bag of which nothing can be read, or one topic with two types.
    """
    if not path.exists():
        beside = sorted(other.name for other in path.parent.iterdir()) if path.parent.is_dir() else []
        same = [name for name in beside if name.startswith(f"{path.name}.")]  # the ending is missing
        near = f"; did you mean {same[0]}?" if same else did_you_mean(path.name, beside)
        raise InputError(
            f"{path}: bag does not exist; correct its path in session.yaml or copy it there{near}"
        )
    try:
        return _read(path, bag_files(path), wanted)
    except InputError:
        raise
    except OSError as err:
        raise InputError(f"{path}: bag cannot be read ({err.strerror or one_line(err)})") from err
    except MemoryError as err:
        raise InputError(f"{path}: bag is larger than this machine's memory; split it") from err
    except Exception as err:  # a damaged file fails in as many ways as there are parsers
        raise _useless(path, one_line(err) or type(err).__name__) from err


def _useless(path: Path, reason: str) -> InputError:
    return InputError(f"{path}: bag is damaged or truncated ({reason}); copy it again or record anew")


def _read(path: Path, found: BagFiles, wanted: Collection[str]) -> Bag:
    contents = Contents(path, wanted)
    notes = list(found.notes)
    of_files = [note for file in found.files for note in _read_file(file, found.metadata.storage, contents)]
    messages = sum(contents.counts.values())
    if of_files and not messages:
        raise _useless(path, of_files[0])
    if messages < found.metadata.messages:
        notes.append(f"{messages} messages were read of the {found.metadata.messages} in metadata.yaml")
    order = dict.fromkeys((*found.metadata.topics, *contents.listed))
    listed = {name: contents.listed.get(name) or found.metadata.topics[name] for name in order}
    topics = {name: contents.take(name, listed[name]) for name in listed if name in wanted}
    counts = {name: contents.counts.get(name, 0) for name in listed}
    return Bag(path, listed, topics, counts, (*notes, *of_files))


def _read_file(file: Path, storage: str | None, contents: Contents) -> list[str]:
    """Read one file; what is to be said of it, in whole sentences."""
    contents.begin(file.stat().st_size)
    with opened(file) as (inner, kind, notes):
        if kind not in _READERS:
            return [f"{file.name} is damaged or truncated: it does not begin as a bag's file"]
        if storage not in (None, kind):
            notes.append(f"is read as {kind} by its first bytes; metadata.yaml says {storage or 'nothing'!r}")
        notes += _READERS[kind](inner, contents)
    return [f"{file.name} {note}" for note in notes]
