"""``read``: every message of a session on disk, as tables for a person and as arrays for ``check``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig_identification.errors import InputError, did_you_mean

if TYPE_CHECKING:
    import pandas as pd

    from rig_identification.raw import RawChannel, RawSession
    from rig_identification.rig import Rig

Progress = Callable[[str], None]

#: Columns of a channel's values, in the order of ``recording.Recording``.
COLUMNS = {
    "tension": ("tension",),
    "exciter_force": ("x", "y", "z"),
    "exciter_shaft": ("angle", "rate"),
    "imu": (
        *(f"angular_rate_{axis}" for axis in "xyz"),
        *(f"specific_force_{axis}" for axis in "xyz"),
    ),
    "inclination": ("x", "y"),
    "mocap": ("x", "y", "z", "qx", "qy", "qz", "qw"),
    "ground_truth": (
        *("x", "y", "z", "qx", "qy", "qz", "qw"),
        *("vx", "vy", "vz"),
        *(f"angular_rate_{axis}" for axis in "xyz"),
    ),
}


@dataclass(frozen=True)
class Recorded:
    """A session as it was recorded: nothing is left out or corrected yet."""

    raw: RawSession
    path: Path  # the session's folder, or its session.yaml

    @property
    def name(self) -> str:
        """Name of the session's folder."""
        return self.raw.name

    @property
    def rig(self) -> Rig:
        """The rig as described."""
        return self.raw.rig

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings, as in ``session.yaml``."""
        return tuple(recording.name for recording in self.raw.recordings)

    @property
    def topics(self) -> pd.DataFrame:
        """One row a topic that the contract knows: recording, topic, device, type, messages, rate in Hz."""
        from rig_identification.api.tables import table

        return table([_account(r.name, c) for r in self.raw.recordings for c in r.channels])

    def frame(self, recording: str, topic: str) -> pd.DataFrame:
        """Messages of one topic.

        Parameters
        ----------
        recording : str
            One of :attr:`recordings`.
        topic : str
            The topic's name in the bag, with or without its namespace: ``imu/data_raw``.

        Returns
        -------
        pandas.DataFrame
            SI units. Index ``time``: s after the topic's first stamp.

        Raises
        ------
        InputError
            There is no such recording or topic.
        """
        from rig_identification.api.tables import timed

        channel = self._channel(recording, topic)
        time = (channel.stamp_ns - channel.stamp_ns[0]) * 1e-9
        return timed(time, dict(zip(COLUMNS[channel.channel], channel.values.T, strict=True)))

    def _channel(self, recording: str, topic: str) -> RawChannel:
        for one in self.raw.recordings:
            if one.name == recording:
                names = {c.topic.removeprefix(f"{self.raw.namespace}/"): c for c in one.channels}
                found = {**names, **{c.topic: c for c in one.channels}}
                if topic in found:
                    return found[topic]
                known = f"it has {', '.join(names)}{did_you_mean(topic, names)}"
                raise InputError(f"{self.name}: {recording}: {topic}: is no topic of it; {known}")
        known = f"the session has {', '.join(self.recordings)}{did_you_mean(recording, self.recordings)}"
        raise InputError(f"{self.name}: {recording}: is no recording; {known}")

    def _repr_html_(self) -> str:
        from rig_identification.api.html import rows_html

        rows = [_account(r.name, c) for r in self.raw.recordings for c in r.channels]
        return rows_html(f"{self.name}, as recorded", rows)


def read(
    session: str | Path,
    *,
    namespace: str = "/rig",
    topics: Mapping[str, str] | None = None,
    progress: Progress | None = None,
) -> Recorded:
    """Read a session from disk.

    Parameters
    ----------
    session : str or Path
        The session's folder, or its ``session.yaml``.
    namespace : str
        Namespace of the topics.
    topics : mapping, optional
        Topics of other names: name in the contract (``imu/data_raw``) to name in the bag.
    progress : callable, optional
        Called with one sentence before each bag is read.

    Raises
    ------
    InputError
        Something cannot be read. The message is one line: where, which value, what to do.
    """
    from rig_identification.session import read_raw

    raw = read_raw(Path(session), namespace=namespace, topics=topics, progress=progress)
    return Recorded(raw, Path(session))


def _account(recording: str, channel: RawChannel) -> dict[str, Any]:
    """What is told of one topic."""
    import numpy as np

    count = len(channel.stamp_ns)
    period = float(np.median(np.diff(channel.stamp_ns))) if count > 1 else 0.0
    return {
        "recording": recording,
        "topic": channel.topic,
        "device": channel.device,
        "type": channel.message_type,
        "messages": count,
        "rate": 1e9 / period if period > 0.0 else 0.0,
    }


def named_files(session: str | Path) -> tuple[Path, ...]:
    """All that a session's description names, and what lies in its bags. Raises InputError."""
    from rig_identification.errors import MissingDescription
    from rig_identification.session.provenance import files_at
    from rig_identification.session.session_description import read_session_description

    try:
        description = read_session_description(Path(session))
    except MissingDescription:
        return (Path(session),)
    bags = [entry.folder for entry in description.entries]
    return (description.file, description.rig_file, *bags, *files_at(*bags))
