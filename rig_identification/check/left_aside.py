"""What is mounted and not recorded, and what is recorded and not used, in sentences."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rig_identification.check.inventory import MOUNTED, offsets, shift_text
from rig_identification.examination import TopicAccount
from rig_identification.raw import RawRecording, RawSession

#: What each device sends: its topic without the namespace, and the message types that such devices send,
#: the contract's first. A topic of one of these types and another name may be a device that is missed.
_KIN = {
    "imu": ("imu/data_raw", ("sensor_msgs/msg/Imu",)),
    "inclinometer": (
        "inclinometer/angles",
        ("geometry_msgs/msg/Vector3Stamped", "geometry_msgs/msg/Vector3"),
    ),
    "exciter": ("exciter/wrench", ("geometry_msgs/msg/WrenchStamped", "geometry_msgs/msg/Wrench")),
    "mocap": (
        "mocap/pose",
        (
            "geometry_msgs/msg/PoseStamped",
            "geometry_msgs/msg/Pose",
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            "geometry_msgs/msg/TransformStamped",
        ),
    ),
}
_CELL_TYPES = _KIN["exciter"][1]
_ALL_TYPES = frozenset(kind for _, kinds in _KIN.values() for kind in kinds)
#: Results of this project's own nodes, which a recorder of everything records too.
_RESULTS = ("generalized_wrench", "generalized_wrench_std")


@dataclass(frozen=True)
class LeftAside:
    """Sentences for a person."""

    warnings: tuple[str, ...]
    notes: tuple[str, ...]


def left_aside(raw: RawSession, used: RawSession, topics: Sequence[TopicAccount]) -> LeftAside:
    """What of devices and topics the fit goes without.

    Parameters
    ----------
    raw, used : RawSession
        As recorded, and as the examiners left it.
    topics : sequence of TopicAccount
        Of the inventory.
    """
    strangers = _strangers(raw, topics)
    missing, claimed = _missing(raw, strangers)
    warnings = [*missing, *_partial(raw), *_unclaimed(raw, strangers, claimed)]
    warnings += [*_unmounted(raw), *_apart(used), *_dropped(raw, used)]
    return LeftAside(tuple(warnings), _no_cells(raw, strangers))


def _strangers(raw: RawSession, topics: Sequence[TopicAccount]) -> dict[str, tuple[str, list[str]]]:
    """Topics of no device that look like one's: name -> message type, recordings."""
    found: dict[str, tuple[str, list[str]]] = {}
    for account in topics:
        recorded = account.device is None and account.count > 0
        if recorded and _looks_like_a_device(raw, account.topic, account.message_type):
            found.setdefault(account.topic, (account.message_type, []))[1].append(account.recording)
    return found


def _looks_like_a_device(raw: RawSession, topic: str, message_type: str) -> bool:
    prefix = _prefix(raw)
    if topic in {prefix + name for name in _RESULTS}:
        return False
    names = {*_KIN, *(cable.name for cable in raw.rig.cables)}
    return message_type in _ALL_TYPES or any(topic.startswith(f"{prefix}{name}/") for name in names)


def _missing(
    raw: RawSession, strangers: Mapping[str, tuple[str, list[str]]]
) -> tuple[list[str], frozenset[str]]:
    """A sentence for each mounted device that no bag holds, and the strangers that it names."""
    sentences, claimed = [], set[str]()
    for device, topic, kinds in _mounted(raw):
        if not _relevant(raw, device) or any(r.channel(device) is not None for r in raw.recordings):
            continue
        like = [name for name, (kind, _) in strangers.items() if kind in kinds]
        if device not in _KIN:  # of many wrenches those that are named like the cable
            like = difflib.get_close_matches(_prefix(raw) + topic, like, n=1, cutoff=0.6)
        claimed |= set(like)
        sentences.append(
            f"{device}: the rig description mounts it, and no bag holds a message of {_prefix(raw)}{topic}: "
            f"it tells nothing of this session. {_mapping(topic, like, strangers)}"
        )
    return sentences, frozenset(claimed)


def _mapping(topic: str, like: Sequence[str], strangers: Mapping[str, tuple[str, list[str]]]) -> str:
    if not like:
        return "Record it, or take it out of the description."
    choices = " or ".join(f"--topic {topic}={name}" for name in like)
    held = " and ".join(f"{name} ({strangers[name][0]})" for name in like)
    return f"The bags hold {held}: give {choices} where that is it."


def _mounted(raw: RawSession) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Device, topic and message types of all that the description mounts; no cells where none is recorded."""
    for device, (topic, kinds) in _KIN.items():
        if getattr(raw.rig, device) is not None:
            yield device, topic, kinds
    if _any_cell(raw):
        yield from ((cable.name, f"{cable.name}/wrench", _CELL_TYPES) for cable in raw.rig.cables)


def _relevant(raw: RawSession, device: str) -> list[RawRecording]:
    """Recordings in which a device is expected: an exciter stands still while the body rests."""
    return [r for r in raw.recordings if device != "exciter" or r.kind == "dynamic"]


def _partial(raw: RawSession) -> Iterator[str]:
    for device, _, _ in _mounted(raw):
        expected = _relevant(raw, device)
        without = [r.name for r in expected if r.channel(device) is None]
        topic = next((found.topic for r in raw.recordings if (found := r.channel(device)) is not None), None)
        if without and topic is not None and len(without) < len(expected):
            yield f"{device}: {topic} is missing in {_listed(without)}, and there in the other bags."


def _unclaimed(
    raw: RawSession, strangers: Mapping[str, tuple[str, list[str]]], claimed: frozenset[str]
) -> Iterator[str]:
    cables = ", ".join(cable.name for cable in raw.rig.cables)
    for name, (kind, recordings) in strangers.items():
        if name in claimed:
            continue
        where = "every bag" if len(recordings) == len(raw.recordings) else _listed(recordings)
        cable = _cable_of(raw, name)
        why = (
            f"{cable} is no cable of the rig description, which has {cables}"
            if cable is not None
            else f"it is no topic of the contract under {_prefix(raw).rstrip('/') or '/'}"
        )
        yield (
            f"{name} ({kind}, in {where}) is not used: {why}. "
            "Map it with --topic where it is one of the rig's."
        )


def _cable_of(raw: RawSession, topic: str) -> str | None:
    parts = topic.removeprefix(_prefix(raw)).split("/")
    known = {*_KIN, *(cable.name for cable in raw.rig.cables)}
    is_cell = topic.startswith(_prefix(raw)) and len(parts) == 2 and parts[1] == "wrench"
    return parts[0] if is_cell and parts[0] not in known else None


def _unmounted(raw: RawSession) -> Iterator[str]:
    for device in MOUNTED:
        topics = [c.topic for r in raw.recordings for c in r.channels if c.device == device]
        if topics and getattr(raw.rig, device) is None:
            what = "orientation" if device == "inclinometer" else "position and orientation"
            yield (
                f"{device}: the bags hold {topics[0]}, and the rig description has no {device}: "
                f"it is left aside. Add its {what} to the description."
            )


def _apart(used: RawSession) -> Iterator[str]:
    """One sentence a topic whose stamps share no time with the others', with the largest amount."""
    found: dict[str, list[tuple[str, float]]] = {}
    for recording in used.recordings:
        for topic, seconds in offsets(recording).items():
            found.setdefault(topic, []).append((recording.name, seconds))
    for topic, places in found.items():
        most = max((seconds for _, seconds in places), key=abs)
        yield (
            f"{topic}: its {shift_text(most)} in {_listed([name for name, _ in places])}: "
            "they share no time, and nothing of it is used. Set the device's clock, or stamp when measured."
        )


def _dropped(raw: RawSession, used: RawSession) -> Iterator[str]:
    found: dict[str, list[str]] = {}
    left = {recording.name: recording for recording in used.recordings}
    for recording in raw.recordings:
        kept = {c.topic for c in left[recording.name].channels} if recording.name in left else set()
        for channel in recording.channels:
            if channel.topic not in kept:
                found.setdefault(channel.topic, []).append(recording.name)
    for topic, names in found.items():
        yield f"{topic} is left out of {_listed(names)}: a fault of the set-up says why."


def _no_cells(raw: RawSession, strangers: Mapping[str, tuple[str, list[str]]]) -> tuple[str, ...]:
    """Rigs without load cells are ordinary: a note and no warning."""
    if _any_cell(raw) or any(kind in _CELL_TYPES for kind, _ in strangers.values()):
        return ()
    return ("No load cell is recorded: tensions tell nothing of this session.",)


def _any_cell(raw: RawSession) -> bool:
    return any(channel.cable is not None for r in raw.recordings for channel in r.channels)


def _prefix(raw: RawSession) -> str:
    """What precedes a topic's contract name."""
    space = raw.namespace.strip("/")
    return f"/{space}/" if space else "/"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
