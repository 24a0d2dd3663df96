"""Messages as recorded to the usable samples of each recording, with an account of what was left out."""

from __future__ import annotations

import numpy as np

from rig_identification.cleaning.channel import Channel, clean_channel
from rig_identification.cleaning.rest import check_rest
from rig_identification.errors import InputError
from rig_identification.raw import RawRecording, RawSession
from rig_identification.recording import ChannelQuality, Recording, Series, Session
from rig_identification.rig import Rig
from rig_identification.topics import foreign_cable, other_namespace

#: A dynamic run must last this long to tell anything.
SHORTEST_RUN = 1.0  # s
#: s, by kind, that a recording lasts at most; what seems to last longer has stamps of no clock.
LONGEST = {"static": 86_400.0, "dynamic": 10_800.0}
#: Clocks of two devices may differ by tolerances, not by this: then one of them was never set.
_CLOCKS_APART = 60_000_000_000  # ns
#: Channels that cannot be used without knowing where the device sits.
_MOUNTED = {"imu": "imu", "inclination": "inclinometer", "exciter_force": "exciter"}


def clean(raw: RawSession) -> Session:
    """Choose the usable samples of every recording.

    Raises
    ------
    InputError
        The first recording that cannot be used: no topic of the contract, no usable stamp, a static recording
        that moves, a run too short, one that seems to last for days.
    """
    recordings = tuple(_cleaned(recording, raw.rig, raw.namespace) for recording in raw.recordings)
    return Session(name=raw.name, rig=raw.rig, recordings=recordings)


def _cleaned(raw: RawRecording, rig: Rig, namespace: str) -> Recording:
    """One recording; what cannot be used of a bag that was not read whole is told with how it was read."""
    try:
        return _usable(raw, rig, namespace)
    except InputError as err:
        if not raw.notes:
            raise
        raise InputError(f"{err} ({'; '.join(raw.notes)})") from err


def _usable(raw: RawRecording, rig: Rig, namespace: str) -> Recording:
    moving = raw.kind == "dynamic"
    channels = [clean_channel(channel, raw.where, moving=moving) for channel in raw.channels]
    if all(channel.topic.channel == "ground_truth" for channel in channels):
        known = ", ".join(sorted(raw.listed)) or "none"
        raise InputError(
            f"{raw.where}: no topic of the contract in the bag; it has {known}: map the topics or namespace"
            f"{other_namespace(raw.listed, rig, namespace)}"
        )
    together, apart = _on_one_clock(channels)
    start_ns = min(int(channel.ordered_ns[0]) for channel in together)
    duration = (max(int(channel.ordered_ns[-1]) for channel in together) - start_ns) / 1e9
    _check_length(raw, together, duration)
    reasons = {id(channel): _left_aside(channel, rig, raw.where) for channel in together}
    used = [channel for channel in together if reasons[id(channel)] is None]
    quality = [channel.quality(start_ns, *filter(None, [reasons[id(channel)]])) for channel in together]
    quality += [
        channel.quality(start_ns, "stamps are on another clock than the other topics': left aside")
        for channel in apart
    ]
    quality += _foreign(raw, {channel.topic for channel in raw.channels}, namespace)
    recording = _recording(raw, start_ns, duration, used, tuple(quality))
    _check_motion(recording, rig, raw.where)
    return recording


def _on_one_clock(channels: list[Channel]) -> tuple[list[Channel], list[Channel]]:
    """Channels whose stamps lie together, by majority, and the others."""
    reach = max(int(np.ptp(channel.ordered_ns)) for channel in channels) + _CLOCKS_APART
    middles = [int(channel.ordered_ns[len(channel.ordered_ns) // 2]) for channel in channels]

    def company(index: int) -> tuple[int, int]:
        near = [abs(middle - middles[index]) <= reach for middle in middles]
        return sum(near), len(channels[index].ordered_ns)

    reference = middles[max(range(len(channels)), key=company)]
    near = [abs(middle - reference) <= reach for middle in middles]
    together = [channel for channel, is_near in zip(channels, near, strict=True) if is_near]
    return together, [channel for channel, is_near in zip(channels, near, strict=True) if not is_near]


def _check_length(raw: RawRecording, channels: list[Channel], duration: float) -> None:
    """Raise InputError where a recording seems to last for days: every second of it costs memory and time."""
    longest = LONGEST[raw.kind]
    if duration > longest:
        channel = max(channels, key=lambda channel: int(np.ptp(channel.ordered_ns)))
        raise InputError(
            f"{raw.where}: {channel.topic.name}: the recording spans {duration:.3g} s, more than the "
            f"{longest:g} s of a {raw.kind} one; correct the stamps, or cut it into recordings"
        )


def _left_aside(channel: Channel, rig: Rig, where: str) -> str | None:
    """Why a channel cannot be used with this rig description, None where it can."""
    device = _MOUNTED.get(channel.topic.channel)
    if device is None or getattr(rig, device) is not None:
        return None
    if device == "exciter" and np.any(channel.values):
        raise InputError(
            f"{where}: {channel.topic.name}: a force is recorded, the rig description has no exciter; "
            "add its position and orientation"
        )
    return f"the rig description has no {device}: left aside"


def _foreign(raw: RawRecording, expected: set[str], namespace: str) -> list[ChannelQuality]:
    """Topics of cables that the rig description does not know."""
    accounts = []
    for name in raw.listed:
        cable = foreign_cable(name, namespace)
        if cable is not None and name not in expected:
            note = f"{cable} is no cable of the rig description: left aside"
            accounts.append(ChannelQuality(name, 0, 0, 0.0, 0.0, 0.0, 0, 0, 0.0, 0, 0, 0, 0, (note,)))
    return accounts


def _recording(
    raw: RawRecording,
    start_ns: int,
    duration: float,
    used: list[Channel],
    quality: tuple[ChannelQuality, ...],
) -> Recording:
    tension: dict[str, Series] = {}
    others: dict[str, Series | None] = {}
    unmeasured = False
    for channel in used:
        series = channel.series(start_ns)
        unmeasured |= channel.topic.channel == "exciter_force" and series is None
        if channel.topic.cable is None:
            others[channel.topic.channel] = series
        elif series is not None:
            tension[channel.topic.cable] = series
    return Recording(
        name=raw.name, kind=raw.kind, holdout=raw.holdout, start_ns=start_ns, duration=duration,
        dummy=raw.dummy, tension=tension, exciter_unmeasured=unmeasured, quality=quality, notes=raw.notes,
        **others,
    )  # fmt: skip


def _check_motion(recording: Recording, rig: Rig, where: str) -> None:
    if recording.kind == "static":
        check_rest(recording, rig, where)
    elif recording.duration < SHORTEST_RUN:
        raise InputError(
            f"{where}: dynamic run lasts {recording.duration:.3g} s, less than {SHORTEST_RUN:g} s; "
            "record a longer one"
        )
