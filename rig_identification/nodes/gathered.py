"""What a window holds so far, as numbers, and a file of it for the program that watches."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig_identification.nodes.intake import Batch
from rig_identification.nodes.session_folder import RecordingPlan
from rig_identification.raw import RawChannel, RawRecording
from rig_identification.recording import Dummy
from rig_identification.topics import Topic

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
Piece = tuple[Stamps, Stamps, Array]


class Gathered:
    """Samples of one window; of a long one those of the last ``longest`` s."""

    def __init__(self, plan: RecordingPlan, longest: float) -> None:
        self.plan = plan
        self._longest_ns = round(1e9 * longest)
        self._topics: dict[str, Topic] = {}
        self._pieces: dict[str, list[Piece]] = {}
        self.whole = True  # nothing was let go yet

    def add(self, batch: Batch) -> None:
        """Take in what arrived on a topic."""
        if not len(batch.heard_ns):
            return
        name = batch.topic.name
        self._topics[name] = batch.topic
        pieces = self._pieces.setdefault(name, [])
        pieces.append((batch.heard_ns, batch.arrival_ns[-len(batch.heard_ns) :], batch.heard))
        newest = int(batch.arrival_ns[-1])
        while len(pieces) > 1 and newest - int(pieces[0][1][-1]) > self._longest_ns:
            pieces.pop(0)
            self.whole = False

    @property
    def seconds(self) -> float:
        """From the first to the last arrival that is held."""
        if not self._pieces:
            return 0.0
        first = min(int(pieces[0][1][0]) for pieces in self._pieces.values())
        last = max(int(pieces[-1][1][-1]) for pieces in self._pieces.values())
        return (last - first) / 1e9

    def arrays(self, prefix: str) -> dict[str, NDArray[np.generic]]:
        """Stamps, arrivals and values by topic."""
        out: dict[str, NDArray[np.generic]] = {}
        for number, pieces in enumerate(self._pieces.values()):
            for name, column in zip(("stamp", "received", "values"), zip(*pieces, strict=True), strict=True):
                out[f"{prefix}.{number}.{name}"] = np.concatenate(column)
        return out

    def described(self) -> dict[str, object]:
        """What the arrays are of."""
        dummy = self.plan.dummy
        return {
            "name": self.plan.name,
            "kind": self.plan.kind,
            "dummy": None if dummy is None else [dummy.mass, *dummy.position.tolist()],
            "topics": [[t.name, t.channel, t.message_type, t.cable] for t in self._topics.values()],
        }


def write_gathered(file: Path, windows: Sequence[Gathered]) -> None:
    """Write windows into one file."""
    about = json.dumps([window.described() for window in windows])
    arrays = {k: v for number, window in enumerate(windows) for k, v in window.arrays(str(number)).items()}
    with file.open("wb") as stream:
        np.savez(stream, about=np.array(about), **arrays)  # type: ignore[arg-type]


def read_gathered(file: Path) -> tuple[RawRecording, ...]:
    """The windows of a file as recordings."""
    with np.load(file, allow_pickle=False) as held:
        return tuple(
            _recording(about, {k: held[k] for k in held.files if k.startswith(f"{number}.")}, str(number))
            for number, about in enumerate(json.loads(str(held["about"])))
        )


def _recording(about: dict[str, object], arrays: dict[str, Array], prefix: str) -> RawRecording:
    channels = []
    topics = about["topics"]
    assert isinstance(topics, list)
    for number, (topic, channel, kind, cable) in enumerate(topics):
        stamp, received, values = (
            arrays[f"{prefix}.{number}.{part}"] for part in ("stamp", "received", "values")
        )
        channels.append(
            RawChannel(topic, channel, kind, stamp.astype(np.int64), received.astype(np.int64), values, cable)
        )
    given = about["dummy"]
    dummy = Dummy(float(given[0]), np.array(given[1:])) if isinstance(given, list) else None
    name = str(about["name"])
    return RawRecording(
        name, str(about["kind"]), False, name, tuple(channels),
        {c.topic: c.message_type for c in channels}, {c.topic: c.stamp_ns.size for c in channels}, dummy,
    )  # fmt: skip
