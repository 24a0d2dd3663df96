"""The stamps of one topic of one bag as the examiners of stamps see them, and a session with other stamps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.raw import RawChannel, RawRecording, RawSession, Stamps

Array = NDArray[np.float64]

SECOND = 1_000_000_000
#: With fewer stamps no regularity can be told from chance.
FEWEST = 20
#: Written by a simulator, never an input: it is mended along with the devices and told of by nobody.
GROUND_TRUTH = "ground_truth"


@dataclass(frozen=True)
class Stream:
    """One topic of one bag."""

    place: int  # of the recording in the session
    recording: str
    channel: RawChannel

    @property
    def device(self) -> str:
        """Contract word of the device."""
        return self.channel.device

    @property
    def stamps(self) -> Stamps:
        """(n,) ns, in the order of the file."""
        return self.channel.stamp_ns

    @property
    def received(self) -> Stamps:
        """(n,) ns, in the order of the file."""
        return self.channel.received_ns

    def with_stamps(self, stamps: Stamps) -> Stream:
        """This stream with other stamps (n,), ns."""
        return replace(self, channel=replace(self.channel, stamp_ns=stamps))

    @property
    def key(self) -> tuple[int, str]:
        """What tells this stream from the session's others."""
        return self.place, self.channel.topic


def copied(channel: RawChannel) -> bool:
    """Whether receive times are the stamps with a constant added, as a conversion may write them.

    What is off by more than a latency is no copy: one of the two is on a clock of its own.
    """
    wait = channel.received_ns - channel.stamp_ns
    return len(wait) > 0 and bool(np.ptp(wait) < 1000 and 0 <= wait[0] < SECOND)


def streams(session: RawSession, place: int | None = None) -> Iterator[Stream]:
    """Streams with enough stamps to judge, of one recording or of all."""
    for number, recording in enumerate(session.recordings):
        if place in (None, number):
            for channel in recording.channels:
                if len(channel.stamp_ns) >= FEWEST:
                    yield Stream(number, recording.name, channel)


def with_stamps(session: RawSession, stamps: Mapping[tuple[int, str], Stamps]) -> RawSession:
    """The session with other stamps (ns) in these streams; receive times that copy them go along."""

    def changed(channel: RawChannel, key: tuple[int, str]) -> RawChannel:
        if key not in stamps:
            return channel
        other = np.asarray(stamps[key], np.int64)
        received = channel.received_ns
        if copied(channel):
            received = other + (received - channel.stamp_ns)
        return replace(channel, stamp_ns=other, received_ns=received)

    return _changed(session, changed)


def reversed_streams(session: RawSession, keys: frozenset[tuple[int, str]]) -> RawSession:
    """The session with the messages of these streams in the opposite order."""

    def changed(channel: RawChannel, key: tuple[int, str]) -> RawChannel:
        if key not in keys:
            return channel
        return replace(
            channel, stamp_ns=channel.stamp_ns[::-1], received_ns=channel.received_ns[::-1],
            values=channel.values[::-1],
        )  # fmt: skip

    return _changed(session, changed)


def without(session: RawSession, keys: frozenset[tuple[int, str]]) -> RawSession:
    """The session without the streams of these keys."""
    recordings = tuple(
        replace(r, channels=tuple(c for c in r.channels if (place, c.topic) not in keys))
        for place, r in enumerate(session.recordings)
    )
    return replace(session, recordings=recordings)


def _changed(session: RawSession, change: Callable[[RawChannel, tuple[int, str]], RawChannel]) -> RawSession:
    recordings: list[RawRecording] = []
    for place, recording in enumerate(session.recordings):
        channels = tuple(change(channel, (place, channel.topic)) for channel in recording.channels)
        recordings.append(replace(recording, channels=channels))
    return replace(session, recordings=tuple(recordings))


def in_order(session: RawSession) -> RawSession:
    """The session with each topic's samples in the order in which they were measured.

    A message that overtakes another one on its way is ordinary. Read in the order of arrival, its sample
    would stand between two of other times, and look like a spike.
    """

    def ordered(channel: RawChannel) -> RawChannel:
        order = np.argsort(channel.stamp_ns, kind="stable")
        return replace(
            channel,
            stamp_ns=channel.stamp_ns[order],
            received_ns=channel.received_ns[order],
            values=channel.values[order],
        )

    def changed(recording: RawRecording) -> RawRecording:
        mixed = (c for c in recording.channels if np.any(np.diff(c.stamp_ns) < 0))
        return recording.with_channels(*(ordered(c) for c in mixed))

    return replace(session, recordings=tuple(changed(r) for r in session.recordings))
