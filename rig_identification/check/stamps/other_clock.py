"""A device whose clock shows another time: TAI for UTC, another zone, time since boot, simulated time."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.common_clock import ORDINARY, latency, received_together, steady
from rig_identification.check.stamps.streams import GROUND_TRUTH, SECOND, Stream, copied, streams, with_stamps
from rig_identification.check.stamps.told import PRICE, found, owner, quantity, recordings_text
from rig_identification.raw import RawSession, Stamps

ORDER = 50

#: s. TAI is ahead of UTC by this since 2017, GPS time since 2017, TAI of GPS time always.
SCALES = {37.0: "TAI", 18.0: "GPS time", 19.0: "TAI"}
_ZONE = 900.0  # s; time zones differ by quarters of an hour
_LONGEST_ZONE = 14 * 3600.0
#: s. An offset is one of the known ones where it lies this near: the latencies of two devices differ by less.
_NEAR = 0.5
#: s. Both ends of a stream that overlaps the others' lie off by the same within this.
_BOTH_ENDS = 0.1
#: Stamps before this are no time of day: a clock that counts from its own start.
SINCE_START = 10**9 * SECOND // 3


@dataclass(frozen=True)
class _Off:
    """A stream whose clock is off the others'."""

    stream: Stream
    offset: float  # s, positive: ahead
    std: float  # s
    exact: float | None  # s, where the offset is one of those that a scale of time has


def find(session: RawSession) -> tuple[Found, ...]:
    """Devices on another clock than most of their recording, put on the clock of the others."""
    alike: dict[tuple[str, str], list[_Off]] = defaultdict(list)
    apart = [off for place in range(len(session.recordings)) for off in _apart(list(streams(session, place)))]
    for off in apart:
        start = min(int(o.stream.stamps.min()) for o in apart if o.stream.device == off.stream.device)
        alike[_kind(off, start), off.stream.device].append(off)
    result = []
    for kind, some in _shared(alike):
        devices = frozenset(off.stream.device for off in some)
        if devices <= {GROUND_TRUTH} or sum(map(_gain, some)) <= PRICE:
            continue
        session = with_stamps(session, {off.stream.key: _shifted(off) for off in some})
        result.append(_told(session, devices, kind, some))
    return tuple(result)


def _shared(alike: dict[tuple[str, str], list[_Off]]) -> list[tuple[str, list[_Off]]]:
    """What to tell together: devices off by the same, as those of one logger are."""
    ordered = sorted((kind, float(np.median([off.offset for off in some])), device)
                     for (kind, device), some in alike.items())  # fmt: skip
    shared: list[tuple[str, list[_Off]]] = []
    last = ("", 0.0)
    for kind, offset, device in ordered:
        if kind != last[0] or offset - last[1] > ORDINARY:
            shared.append((kind, []))
        shared[-1][1].extend(alike[kind, device])
        last = kind, offset
    return shared


def _gain(off: _Off) -> float:
    """Nats: ordinary offsets are Gaussian with a fifth of what a recorder may take to subscribe.

    Ten such standard deviations are fifty nats; more tells nothing more.
    """
    return min(0.5 * (off.offset / (ORDINARY / 5.0)) ** 2, 50.0)


def _kind(off: _Off, start: int) -> str:
    """Word of the kind. start: ns, the device's first stamp in the session."""
    if off.exact is not None:
        return "leap_seconds"
    return "simulated_stamps" if start < 60 * SECOND else "other_clock"


def _shifted(off: _Off) -> Stamps:
    shift = off.offset if off.exact is None else off.exact
    return off.stream.stamps - round(shift * SECOND)


def _apart(here: list[Stream]) -> list[_Off]:
    """Streams of one recording whose clock is not that of its reference."""
    devices = [s for s in here if s.device != GROUND_TRUTH and np.all(s.stamps[1:] != s.stamps[0])]
    if len({s.device for s in devices}) < 2:
        return []
    together = all(received_together(s, [o for o in devices if o.device != s.device]) for s in devices)
    delays = {s.key: -latency(s.stamps, s.received) for s in here} if together else {}
    groups = _clusters(devices, delays)
    if len(groups) < 2 and all(copied(s.channel) for s in devices):
        delays = {}
        groups = _clusters(devices, delays)
        groups[0] = _covering(groups[0])
        if 2 * len({s.device for s in groups[0]}) <= len({s.device for s in devices}):
            return []  # streams that cover parts of the recording, of which none is the measure
    if len(groups) < 2:
        return []
    reference = _reference(groups, delays)
    truths = [s for s in here if s.device == GROUND_TRUTH]
    result = []
    for stream in [s for group in groups if group is not reference for s in group] + truths:
        off = _offset(stream, reference, delays)
        if off is not None:
            result.append(off)
    return result


def _clusters(devices: list[Stream], delays: dict[tuple[int, str], float]) -> list[list[Stream]]:
    """Streams that share a clock, the largest group first.

    They are neighbours by their offsets from receive times or, where these do not tell, by their middles.
    """

    def place(stream: Stream) -> float:
        if delays:
            return delays[stream.key]
        # Stamps of many years in double precision are good to a quarter of a microsecond.
        return (float(stream.stamps.min()) + float(stream.stamps.max())) / 2.0 / SECOND

    def size(group: list[Stream]) -> tuple[int, int]:
        return len({s.device for s in group}), sum(len(s.stamps) for s in group)

    ordered = sorted(devices, key=place)
    groups = [[ordered[0]]]
    for before, stream in pairwise(ordered):
        if place(stream) - place(before) > ORDINARY:
            groups.append([])
        groups[-1].append(stream)
    return sorted(groups, key=size, reverse=True)


def _covering(group: list[Stream]) -> list[Stream]:
    """Those of some streams that start and end together."""
    starts, ends = (np.array([f(s.stamps) for s in group]) for f in (np.min, np.max))
    off = np.maximum(np.abs(starts - int(np.median(starts))), np.abs(ends - int(np.median(ends))))
    return [s for s, far in zip(group, off, strict=True) if far < ORDINARY / 2.0 * SECOND]


def _reference(groups: list[list[Stream]], delays: dict[tuple[int, str], float]) -> list[Stream]:
    """The group on the recorder's clock where receive times tell, else the largest."""
    for group in groups:
        if delays and -ORDINARY / 5.0 < -float(np.median([delays[s.key] for s in group])) < 2.0 * ORDINARY:
            return group
    largest = groups[0]
    if not delays:
        # Of two clocks TAI or GPS time apart, the one ahead is on TAI or GPS time.
        for group in groups[1:]:
            off = _offset(largest[0], group, delays)
            if off is not None and off.exact is not None and off.exact in SCALES:
                return group
    return largest


def _offset(stream: Stream, reference: list[Stream], delays: dict[tuple[int, str], float]) -> _Off | None:
    """Offset of a stream against the reference, None where nothing tells it or it is ordinary."""
    off = _by_receipt(stream, reference, delays) if delays else _by_ends(stream, reference)
    return off if off is not None and abs(off.offset) > ORDINARY else None


def _by_receipt(stream: Stream, reference: list[Stream], delays: dict[tuple[int, str], float]) -> _Off | None:
    usual = np.array([delays[s.key] for s in reference])
    offset = delays[stream.key] - float(np.median(usual))
    if not steady(stream):
        return None  # a clock that steps or runs at another rate
    std = max(float(np.median(np.abs(usual - np.median(usual)))) * 1.5, 1e-3)
    return _Off(stream, offset, std, known_offset(offset))


def _by_ends(stream: Stream, reference: list[Stream]) -> _Off | None:
    """By where a stream starts and ends; a stream that covers a part of the recording tells nothing."""
    first, last = (int(np.median([int(f(s.stamps)) for s in reference])) for f in (np.min, np.max))
    start, end = (int(stream.stamps.min()) - first) / SECOND, (int(stream.stamps.max()) - last) / SECOND
    offset, std = (start + end) / 2.0, max(abs(end - start) / 2.0, 0.02)
    disjoint = abs(offset) > 2.0 * (last - first) / SECOND
    if abs(end - start) <= (ORDINARY if disjoint else _BOTH_ENDS):
        return _Off(stream, offset, std, known_offset(offset))
    # One end lies outside of the recording, by an offset that puts the whole stream inside.
    outside = end if offset > 0 else start
    exact = known_offset(outside)
    if exact is not None and start - exact > -ORDINARY and end - exact < ORDINARY:
        return _Off(stream, exact, std, exact)
    return None


def known_offset(offset: float) -> float | None:
    """The offset between scales of time, or between zones, that a measured one is near to."""
    for scale in SCALES:
        if abs(abs(offset) - scale) < _NEAR:
            return float(np.copysign(scale, offset))
    zone = round(offset / _ZONE) * _ZONE
    return zone if 0.0 < abs(zone) <= _LONGEST_ZONE and abs(offset - zone) < _NEAR else None


def _told(session: RawSession, devices: frozenset[str], kind: str, some: list[_Off]) -> Found:
    where = [session.recordings[place].name for place in sorted({off.stream.place for off in some})]
    main = [off for off in some if off.stream.device != GROUND_TRUTH]
    offset = float(np.median([off.offset if off.exact is None else off.exact for off in main]))
    std = max(off.std for off in main)
    side = "ahead of" if offset > 0 else "behind"
    apart = f"{abs(offset):,.3f}".rstrip("0").rstrip(".")
    statement = f"{owner(session, devices)} stamps are {apart} s {side} those of the other devices"
    statement += f"{recordings_text(session, where)}{_why(kind, offset, some)}."
    return found(
        session, session, devices, kind, where,
        parameters={
            "offset": quantity(offset, 0.0 if main[0].exact is not None else std, "s"),
            "delay": quantity(0.0, std, "s"),
        },
        statement=statement,
        advice=ADVICE[kind],
        gain=sum(map(_gain, main)),
    )  # fmt: skip


ADVICE = {
    "leap_seconds": "Set the device or its driver to UTC, as the other devices' stamps are.",
    "other_clock": "Synchronize the device's clock with the recording computer's (NTP, PTP), or stamp its "
    "messages with the computer's clock.",
    "simulated_stamps": "Switch use_sim_time off in the driver, or stamp its messages with the computer's "
    "clock.",
}


def _why(kind: str, offset: float, some: list[_Off]) -> str:
    if kind == "leap_seconds":
        if abs(offset) in SCALES:
            return f": they are in {SCALES[abs(offset)]}, not in UTC"
        return ": they are in another time zone"
    start = min(int(off.stream.stamps.min()) for off in some) / SECOND
    if kind == "simulated_stamps":
        return f": they start at {start:.3f} s, as with simulated time"
    return ": the clock counts from its own start" if start < SINCE_START / SECOND else ": another clock"
