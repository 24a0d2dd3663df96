"""A :class:`~rig_identification.recording.Session` to disk, as the recording contract says."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from typing import Literal, TextIO

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from ruamel.yaml import YAML

from rig_identification.errors import InputError
from rig_identification.recording import Recording, Series, Session
from rig_identification.session.messages import TYPESTORE, serialize
from rig_identification.session.rig_document import rig_document
from rig_identification.topics import DEFAULT_NAMESPACE, Topic, expected_topics

_BAG_VERSION: Literal[9] = 9
_LATENCY = 2_000_000  # ns from measurement to receipt, before jitter
STORAGES = ("mcap", "sqlite3")
COMPRESSIONS = ("none", "message", "file", "storage")


def write_session(
    session: Session,
    folder: str | Path,
    *,
    storage: str = "mcap",
    compression: str = "none",
    receive_jitter: float = 0.0,
    rng: np.random.Generator | None = None,
    namespace: str = DEFAULT_NAMESPACE,
    overwrite: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write session.yaml, rig.yaml and one bag a recording.

    The session is written aside and renamed when complete, so ``folder`` is whole or as it was.

    Parameters
    ----------
    session : Session
        What to write. ``Recording.quality`` is not written.
    folder : str or Path
        The new session's folder.
    storage : str
        ``mcap`` or ``sqlite3``.
    compression : str
        ``none``, ``message``, ``file`` or ``storage`` (chunks of mcap), by zstd.
    receive_jitter : float
        s; receive times are late by up to this much, at random, so that messages overtake each other.
    rng : numpy.random.Generator, optional
        Source of the jitter.
    namespace : str
        Namespace of the topics.
    overwrite : bool
        Replace an existing ``folder``.
    progress : callable, optional
        Called with one sentence before each bag is written.

    Returns
    -------
    Path
        ``folder``.

    Raises
    ------
    InputError
        ``folder`` exists, unknown storage or compression, or a recording's name that is no path inside
        ``folder``.
    """
    folder = Path(folder)
    _check(session, folder, storage, compression, overwrite)
    rng = rng or np.random.default_rng(0)
    topics = expected_topics(tuple(cable.name for cable in session.rig.cables), namespace)
    folder.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        fresh = aside / "session"
        fresh.mkdir()
        _dump(rig_document(session.rig), fresh / "rig.yaml")
        _dump(_session_document(session), fresh / "session.yaml")
        for recording in session.recordings:
            if progress is not None:
                progress(f"writing {recording.name}")
            write_bag(recording, fresh / recording.name, topics, storage, compression, receive_jitter, rng)
        if folder.exists():
            os.replace(folder, aside / "replaced")
        os.replace(fresh, folder)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return folder


def _check(session: Session, folder: Path, storage: str, compression: str, overwrite: bool) -> None:
    if folder.exists() and not overwrite:
        raise InputError(f"{folder}: exists already; choose another folder or allow overwriting")
    if storage not in STORAGES:
        raise InputError(f"storage {storage!r} is unknown; give {' or '.join(STORAGES)}")
    if compression not in COMPRESSIONS:
        raise InputError(f"compression {compression!r} is unknown; give {', '.join(COMPRESSIONS)}")
    if (storage, compression) == ("sqlite3", "storage"):
        raise InputError("sqlite3 has no compression 'storage'; give none, message or file, or storage mcap")
    names = [recording.name for recording in session.recordings]
    for name in names:
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts or not path.parts or names.count(name) > 1:
            raise InputError(f"recording {name!r}: is no folder of its own inside the session; rename it")


def _dump(document: dict[str, object], file: Path) -> None:
    with file.open("w", encoding="utf-8") as stream:
        dump(document, stream)


def dump(document: dict[str, object], stream: TextIO) -> None:
    """Write a document as YAML, its keys in their order."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.dump(document, stream)


def _session_document(session: Session) -> dict[str, object]:
    entries: list[dict[str, object]] = []
    for recording in session.recordings:
        entry: dict[str, object] = {"bag": recording.name, "kind": recording.kind}
        if recording.holdout:
            entry["holdout"] = True
        if recording.dummy is not None:
            entry["dummy"] = {"mass": recording.dummy.mass, "position": recording.dummy.position.tolist()}
        entries.append(entry)
    return {"rig": "rig.yaml", "recordings": entries}


def _channels(recording: Recording, topics: dict[str, Topic]) -> Iterator[tuple[Topic, Series]]:
    for topic in topics.values():
        if topic.cable is not None:
            series = recording.tension.get(topic.cable)
        else:
            series = getattr(recording, topic.channel)
        if series is not None and len(series.time):
            yield topic, series


def write_bag(
    recording: Recording,
    folder: Path,
    topics: dict[str, Topic],
    storage: str = "mcap",
    compression: str = "none",
    receive_jitter: float = 0.0,
    rng: np.random.Generator | None = None,
) -> None:
    """Write one recording as a bag into a new folder; options as of :func:`write_session`."""
    rng = rng or np.random.default_rng(0)
    plugin = {"mcap": StoragePlugin.MCAP, "sqlite3": StoragePlugin.SQLITE3}[storage]
    writer = Writer(folder, version=_BAG_VERSION, storage_plugin=plugin)
    writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with writer:
        connections, received, rows = [], [], []
        for topic, series in _channels(recording, topics):
            connections.append(writer.add_connection(topic.name, topic.message_type, typestore=TYPESTORE))
            stamp_ns = recording.start_ns + np.round(series.time * 1e9).astype(np.int64)
            rows.append(serialize(topic, stamp_ns, series.values))
            received.append(stamp_ns + _LATENCY + _late(len(stamp_ns), receive_jitter, rng))
        for number, row, time in _in_order(received):
            writer.write(connections[number], time, rows[number][row].tobytes())


def _late(count: int, jitter: float, rng: np.random.Generator) -> NDArray[np.int64]:
    return np.asarray(rng.uniform(0.0, jitter * 1e9, count), dtype=np.int64)


def _in_order(received: list[NDArray[np.int64]]) -> Iterator[tuple[int, int, int]]:
    """Topic, message and receive time of all messages by receive time."""
    if not received:
        return iter(())
    times = np.concatenate(received)
    number = np.repeat(np.arange(len(received)), [len(item) for item in received])
    row = np.concatenate([np.arange(len(item)) for item in received])
    order = np.argsort(times, kind="stable")
    return zip(number[order].tolist(), row[order].tolist(), times[order].tolist(), strict=True)
