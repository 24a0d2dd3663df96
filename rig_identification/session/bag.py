"""Serialized messages of a rosbag2 folder, taken in bulk.

rosbags reads the metadata and decompresses files. Its message iterator makes several Python objects a
message, so the storages' messages are taken by :mod:`.mcap_storage` and :mod:`.sqlite3_storage`.
"""

from __future__ import annotations

import sys
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2.reader import DirectoryReader
from rosbags.rosbag2.storage_mcap import McapReader

from rig_identification.errors import InputError
from rig_identification.session.fields import one_line
from rig_identification.session.mcap_storage import collect_mcap
from rig_identification.session.raw_topic import Collector, RawTopic
from rig_identification.session.sqlite3_storage import Sqlite3Topics, collect_sqlite3

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd


class _Folder(DirectoryReader):
    """rosbags' reader of bag folders; its own sqlite3 storage counts every message before it opens."""

    STORAGE_PLUGINS: dict[str, Any] = {"mcap": McapReader, "sqlite3": Sqlite3Topics}  # noqa: RUF012


@dataclass(frozen=True)
class Bag:
    """A rosbag2 folder in memory: what it lists, and the wanted topics' messages."""

    folder: Path
    listed: dict[str, str]  # every topic of the bag -> its message type
    topics: dict[str, RawTopic]
    counts: dict[str, int]  # every topic of the bag -> its messages by metadata.yaml


def read_bag(folder: Path, wanted: Collection[str]) -> Bag:
    """Read the messages of the topics ``wanted`` that the bag in ``folder`` lists.

    Raises
    ------
    InputError
        No such folder, no metadata.yaml, a damaged or truncated bag, or one topic with two types.
    """
    if folder.is_file():
        raise InputError(f"{folder}: is a file; give the bag's folder, which holds metadata.yaml too")
    if not folder.is_dir():
        raise InputError(f"{folder}: bag does not exist; correct its path in session.yaml or copy it there")
    if not (folder / "metadata.yaml").is_file():
        raise InputError(f"{folder}: metadata.yaml is missing; copy it or run 'ros2 bag reindex'")
    reader = _Folder(folder)
    try:
        reader.open()
        try:
            return _read(folder, reader, wanted)
        finally:
            reader.close()
    except InputError:
        raise
    except MemoryError as err:  # a damaged length asks for any amount
        raise InputError(
            f"{folder}: bag is damaged, or larger than this machine's memory; copy it again"
        ) from err
    except Exception as err:  # a damaged file fails in as many ways as there are parsers
        reason = one_line(err) or type(err).__name__
        raise InputError(
            f"{folder}: bag is damaged or truncated ({reason}); copy it again or record anew"
        ) from err


def _read(folder: Path, reader: DirectoryReader, wanted: Collection[str]) -> Bag:
    listed: dict[str, str] = {}
    for connection in reader.connections:
        if listed.setdefault(connection.topic, connection.msgtype) != connection.msgtype:
            raise InputError(f"{folder}: {connection.topic}: recorded with two types; keep one publisher")
    chosen = [connection for connection in reader.connections if connection.topic in wanted]
    collector = Collector(zstd.decompress if reader.metadata.compression_mode == "message" else None)
    _collect(reader, {connection.topic for connection in chosen}, collector)
    _check_complete(folder, chosen, collector)
    counts = dict.fromkeys(listed, 0)
    for connection in reader.connections:
        counts[connection.topic] += connection.msgcount
    topics = {name: collector.take(name, listed[name]) for name in listed if name in wanted}
    return Bag(folder, listed, topics, counts)


def _collect(reader: DirectoryReader, topics: set[str], collector: Collector) -> None:
    for storage in reader.storages:
        names = {item.id: item.topic for item in storage.connections if item.topic in topics}
        path = Path(str(storage.path))  # type: ignore[attr-defined]
        if isinstance(storage, McapReader):
            collect_mcap(path, names, collector)
        else:
            collect_sqlite3(path, names, collector)


def _check_complete(folder: Path, chosen: list[Connection], collector: Collector) -> None:
    """A file that was cut off may still open: metadata.yaml tells how much it held."""
    for name in {connection.topic for connection in chosen}:
        promised = sum(connection.msgcount for connection in chosen if connection.topic == name)
        if collector.counts[name] < promised:
            raise InputError(
                f"{folder}: {name}: {collector.counts[name]} messages of the {promised} in metadata.yaml; "
                "the bag is truncated: copy it again or run 'ros2 bag reindex'"
            )
