"""Kinds that each stream shows by itself, told once for the devices that share it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from rig_identification.check.found import Found
from rig_identification.check.stamps.streams import GROUND_TRUTH, Stream, streams, with_stamps
from rig_identification.check.stamps.told import PRICE
from rig_identification.raw import RawSession, Stamps


@dataclass(frozen=True)
class Mended:
    """A stream as it would be without the fault."""

    stream: Stream
    stamps: Stamps  # (n,) ns
    gain: float  # nats
    facts: dict[str, float]  # numbers for the sentence


def mended_streams(session: RawSession, mend: Callable[[Stream], Mended | None]) -> dict[str, list[Mended]]:
    """By device, what ``mend`` makes of its streams, where together they gain more than the price."""
    by_device: dict[str, list[Mended]] = defaultdict(list)
    for stream in streams(session):
        one = mend(stream)
        if one is not None and one.gain > 0.0:
            by_device[stream.device].append(one)
    return {device: some for device, some in by_device.items() if sum(one.gain for one in some) > PRICE}


def groups(by_device: dict[str, list[Mended]]) -> list[frozenset[str]]:
    """Devices to tell of together: all that have the kind. Ground truth goes along, but not alone."""
    have = frozenset(by_device)
    return [have] if have - {GROUND_TRUTH} else []


def undone(
    session: RawSession,
    mend: Callable[[Stream], Mended | None],
    tell: Callable[[RawSession, frozenset[str], list[Mended]], Found],
) -> tuple[Found, ...]:
    """What ``mend`` makes of the session's streams, put into the session and told once for all devices."""
    by_device = mended_streams(session, mend)
    result = []
    for devices in groups(by_device):
        some = [one for device in sorted(devices) for one in by_device[device]]
        session = with_stamps(session, {one.stream.key: one.stamps for one in some})
        result.append(tell(session, devices, some))
    return tuple(result)


def names(some: Iterable[Mended]) -> list[str]:
    """Recordings of these streams, in the session's order."""
    places = {one.stream.place: one.stream.recording for one in some}
    return [places[place] for place in sorted(places)]
