"""From what was found in single channels to faults: where it is, in which recordings and at which times."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import Flags, channels_of, runs
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession


@dataclass(frozen=True)
class Spotted:
    """One fault in one channel of one recording."""

    device: str
    channel: str
    recording: int  # its index in the session
    changed: RawChannel  # the channel without the fault
    spans: tuple[tuple[float, float], ...] = ()  # s after the recording's first stamp; (): all of it
    count: int = 0  # samples concerned
    gain: float = 0.0  # nats
    value: float = 0.0  # the fault's number, in the kind's own unit


def start_ns(recording: RawRecording) -> int:
    """First stamp of a recording: times in a finding count from it."""
    return min(int(channel.stamp_ns.min()) for channel in recording.channels if len(channel.stamp_ns))


def spans_of(flags: Flags, times: np.ndarray) -> tuple[tuple[float, float], ...]:
    """First and last time of each run of true ``flags`` (n,); times (n,) s."""
    return tuple((float(times[a]), float(times[b - 1])) for a, b in zip(*runs(flags), strict=True))


def without(channel: RawChannel, left_out: Flags) -> RawChannel:
    """The channel with the flagged samples not measured."""
    values = np.array(channel.values)
    values[left_out] = np.nan
    return replace(channel, values=values)


def only(channel: RawChannel, kept: Flags) -> RawChannel:
    """The channel with no more than the flagged messages."""
    return replace(
        channel,
        stamp_ns=channel.stamp_ns[kept],
        received_ns=channel.received_ns[kept],
        values=channel.values[kept],
    )


def corrected(session: RawSession, spotted: Iterable[Spotted]) -> RawSession:
    """The session with each spotted channel in its changed form."""
    recordings = list(session.recordings)
    for one in spotted:
        recordings[one.recording] = recordings[one.recording].with_channels(one.changed)
    return replace(session, recordings=tuple(recordings))


def told(
    session: RawSession,
    groups: Iterable[list[Spotted]],
    fault: Callable[[RawSession, list[Spotted]], SetupFault],
) -> tuple[Found, ...]:
    """One fault for each group, each with the session that those before it corrected.

    fault: makes a group's sentences, from the session without what the group spotted.
    """
    found: list[Found] = []
    for group in groups:
        session = corrected(session, group)
        found.append(Found(fault(session, group), session))
    return tuple(found)


def told_of(
    session: RawSession,
    channels: Sequence[str],
    spot: Callable[[list[tuple[int, RawChannel]]], list[Spotted]],
    fault: Callable[[RawSession, list[Spotted]], SetupFault],
    tolerance: float,
) -> tuple[Found, ...]:
    """The faults of one kind, looked for in each device's recordings of these ``channels``.

    spot: what one device shows, from its index of recordings and channels. tolerance: see :func:`together`.
    """
    spotted: list[Spotted] = []
    for (_, channel), recorded in channels_of(session):
        if channel in channels:
            spotted += spot(recorded)
    return told(session, together(spotted, tolerance=tolerance), fault)


def together(spotted: Sequence[Spotted], *, tolerance: float | None = None) -> list[list[Spotted]]:
    """What is one fault: a device in all recordings, and all load cells whose ``value`` agrees.

    Load cells hang on one logger. tolerance: relative, of ``value``; None: cells are one whatever their
    value.
    """
    out: list[list[Spotted]] = []
    for one in spotted:
        for group in out:
            if _belongs(one, group[0], tolerance):
                group.append(one)
                break
        else:
            out.append([one])
    return out


def _belongs(one: Spotted, other: Spotted, tolerance: float | None) -> bool:
    if one.device == other.device and one.channel == other.channel:
        return True
    if one.channel != "tension" or other.channel != "tension":
        return False
    return tolerance is None or abs(one.value - other.value) <= tolerance * abs(other.value)


def where(session: RawSession, group: Sequence[Spotted]) -> dict[str, object]:
    """Channel (a name, or a list of names), axis, recordings and times of one fault."""
    devices = devices_of(group)
    named = sorted({one.recording for one in group})
    times = [
        {"recording": session.recordings[number].name, "start": round(start, 3), "end": round(end, 3)}
        for number in named
        for start, end in _merged([span for one in group if one.recording == number for span in one.spans])
    ]
    place: dict[str, object] = {
        "channel": devices[0] if len(devices) == 1 else devices,
        "axis": None,
        "recordings": [session.recordings[number].name for number in named],
    }
    return {**place, "times": times} if times else place


def _merged(spans: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The spans, or one from the first to the last where they are too many to read (more than ten)."""
    ordered = sorted(set(spans))
    if len(ordered) > 10:
        return [(ordered[0][0], max(end for _, end in ordered))]
    return ordered


def devices_of(group: Sequence[Spotted]) -> list[str]:
    """Names of the devices, each once, in the order of finding."""
    return list(dict.fromkeys(one.device for one in group))


def listed(names: Sequence[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def of_recordings(session: RawSession, group: Sequence[Spotted]) -> str:
    """Names of the recordings for a sentence."""
    return listed([session.recordings[number].name for number in sorted({one.recording for one in group})])
