"""Stamps that were never set: all zero, or all the same."""

from __future__ import annotations

import math

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.common_clock import latency, received_together
from rig_identification.check.stamps.mended import Mended, groups, mended_streams, names
from rig_identification.check.stamps.regular import envelope_grid, seconds
from rig_identification.check.stamps.streams import SECOND, Stream, streams, with_stamps, without
from rig_identification.check.stamps.told import found, owner, quantity, recordings_text
from rig_identification.raw import RawSession, Stamps

ORDER = 40

#: Part of the messages with one same stamp from which the rest cannot stand for the stream.
_MOST = 0.5


def find(session: RawSession) -> tuple[Found, ...]:
    """Streams without stamps: those of receipt in their place, on the regular grid under them."""
    by_device = mended_streams(session, _unset)
    result = []
    for devices in groups(by_device):
        some = [one for device in sorted(devices) for one in by_device[device]]
        result.append(_in_place(session, devices, some, by_device))
        session = result[-1].session
    return tuple(result)


def _unset(stream: Stream) -> Mended | None:
    _, counts = np.unique(stream.stamps, return_counts=True)
    same = int(counts.max())
    zero = int(np.count_nonzero(stream.stamps <= 0))
    most = max(same, zero)
    if most <= _MOST * len(stream.stamps):
        return None
    # Repeats are ordinary for a message in twenty at the very most.
    gain = most * math.log(20.0)
    return Mended(stream, stream.stamps, gain, {"unset": most, "zero": float(zero >= same)})


def _in_place(
    session: RawSession, devices: frozenset[str], some: list[Mended], every: dict[str, list[Mended]]
) -> Found:
    unset = {one.stream.key for group in every.values() for one in group}
    stamps: dict[tuple[int, str], Stamps] = {}
    lost: list[tuple[int, str]] = []
    stds = []
    for one in some:
        here = [s for s in streams(session, one.stream.place) if s.key != one.stream.key]
        sound = [s for s in here if s.key not in unset]
        placed = _by_receipt(one.stream, here, sound)
        if placed is None:
            lost.append(one.stream.key)
        else:
            stamps[one.stream.key] = placed[0]
            stds.append(placed[1])
    corrected = without(with_stamps(session, stamps), frozenset(lost))
    where = names(some)
    count, unset_count = sum(len(one.stamps) for one in some), int(sum(one.facts["unset"] for one in some))
    what = "zero" if all(one.facts["zero"] for one in some) else "the same"
    done = "Receive times stand in their place" if not lost else "Receive times do not tell either: left out"
    return found(
        session, corrected, devices, "zero_stamps", where,
        parameters={"delay": quantity(0.0, max(stds, default=0.0), "s")},
        statement=f"{owner(session, devices)} stamps were never set: {unset_count:,} of {count:,} are {what}"
        f"{recordings_text(session, where)}. {done}.",
        advice="Set header.stamp in the driver when the device measures.",
        gain=sum(one.gain for one in some), undone=not lost,
    )  # fmt: skip


def _by_receipt(one: Stream, here: list[Stream], sound: list[Stream]) -> tuple[Stamps, float] | None:
    """(n,) ns and their common std (s) from receive times, None where these do not run regularly."""
    received = one.received
    if np.any(np.diff(received) < 0) or np.ptp(received) <= 0 or (here and not received_together(one, here)):
        return None
    grid = envelope_grid(seconds(received))
    jitter = float(np.quantile(grid.late, 0.9) - np.quantile(grid.late, 0.1))
    shortest = [latency(s.stamps, s.received) for s in sound]
    usual = float(np.median(shortest)) if shortest else 0.0
    if abs(usual) > 1.0:
        usual = 0.0  # the others' clocks are not the recorder's: they are dealt with as such
    times = grid.times - usual
    stamps = received[0] + np.round(times * SECOND).astype(np.int64)
    spread = float(np.median(np.abs(np.array(shortest) - usual))) * 1.5 if shortest else 0.0
    return np.maximum.accumulate(stamps), math.hypot(max(spread, 1e-3), 0.1 * jitter)
