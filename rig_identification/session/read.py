"""A session on disk to a validated :class:`~rig_identification.recording.Session`, in two stages.

:func:`read_raw` takes every message as it stands; :func:`clean` chooses the usable samples. What examines a
session (``check/``) works between them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from rig_identification.cleaning import clean
from rig_identification.errors import MissingDescription
from rig_identification.raw import RawRecording, RawSession
from rig_identification.recording import Recording, Session
from rig_identification.rig import Rig
from rig_identification.session.bag import read_bag
from rig_identification.session.channel import raw_channel
from rig_identification.session.not_a_session import FILE
from rig_identification.session.proposal import ReadRun, propose
from rig_identification.session.rig_description import read_rig
from rig_identification.session.session_description import (
    BagEntry,
    SessionDescription,
    read_session_description,
)
from rig_identification.topics import DEFAULT_NAMESPACE, Topic, check_mapped, expected_topics

Progress = Callable[[str], None]


def read_session(
    path: str | Path,
    *,
    namespace: str = DEFAULT_NAMESPACE,
    topics: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> Session:
    """Read a session: description, rig and every bag, validated once.

    Parameters and errors as of :func:`read_raw` and :func:`clean`.
    """
    return clean(read_raw(path, namespace=namespace, topics=topics, progress=progress))


def read_raw(
    path: str | Path,
    *,
    namespace: str = DEFAULT_NAMESPACE,
    topics: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> RawSession:
    """Read a session's descriptions and every message of the contract's topics.

    Parameters
    ----------
    path : str or Path
        The session's folder or its session.yaml.
    namespace : str
        Namespace of the topics.
    topics : mapping, optional
        Topics of other names: contract name (``imu/data_raw``) to name in the bag.
    progress : callable, optional
        Called with one sentence before each bag is read.

    Raises
    ------
    InputError
        The first thing that cannot be read, as one line: where, what, which value, what to do. A topic that
        ``topics`` names and no bag holds is one.
    MissingDescription
        Bags without a session.yaml, with the text of one to edit.
    """
    description = _description(Path(path), namespace, topics, progress)
    rig = read_rig(description.rig_file)
    expected = expected_topics(tuple(cable.name for cable in rig.cables), namespace, topics)
    recordings = []
    for entry in description.entries:
        if progress is not None:
            progress(f"reading {entry.name}")
        recordings.append(_read_raw(entry, expected))
    check_mapped(topics or {}, expected, [recording.listed for recording in recordings])
    name = description.file.resolve().parent.name
    return RawSession(name, rig, tuple(recordings), namespace)


def _description(
    path: Path, namespace: str, topics: Mapping[str, str] | None, progress: Progress | None
) -> SessionDescription:
    """The session's description; where bags have none, the error carries the text of one."""
    try:
        return read_session_description(path)
    except MissingDescription as err:
        raise MissingDescription(
            f"{err}; edit the proposal and save it as {path / FILE}, or let rig-identification init write it",
            propose(path, namespace, read_run(namespace, topics), progress),
        ) from err


def read_run(namespace: str, topics: Mapping[str, str] | None) -> ReadRun:
    """What reads one bag as a dynamic run of a rig and cleans it."""

    def read(bag: Path, rig: Rig) -> Recording:
        expected = expected_topics(tuple(cable.name for cable in rig.cables), namespace, topics)
        raw = _read_raw(BagEntry(bag.name, bag, "dynamic", False, None), expected)
        return clean(RawSession("", rig, (raw,), namespace)).recordings[0]

    return read


def _read_raw(entry: BagEntry, expected: dict[str, Topic]) -> RawRecording:
    bag = read_bag(entry.folder, expected)
    empty = [name for name, topic in bag.topics.items() if not topic.count]
    # A wrong type is told of an empty topic too: its messages would be of no use.
    channels = [
        raw_channel(bag.topics.pop(name), expected[name], str(bag.folder)) for name in list(bag.topics)
    ]
    notes = [*bag.notes, *(f"{name} has no message: taken as not recorded" for name in empty)]
    return RawRecording(
        name=entry.name, kind=entry.kind, holdout=entry.holdout, where=str(bag.folder),
        channels=tuple(channel for channel in channels if channel.topic not in empty),
        listed=bag.listed, counts=bag.counts, dummy=entry.dummy,
        notes=tuple(f"{entry.name}: {note}" for note in notes),
    )  # fmt: skip
