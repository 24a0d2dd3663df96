"""All devices on one clock that is not the recorder's: TAI for UTC, another zone, simulated time.

The devices agree with each other, so nothing is to be corrected. A bag that was played and recorded again has
receipts of another time as well, and no fault: only an offset that scales of time have, the same in several
recordings, or stamps that are no time of day are told.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.common_clock import ORDINARY, latency, received_together, steady
from rig_identification.check.stamps.other_clock import ADVICE, SCALES, SINCE_START, known_offset
from rig_identification.check.stamps.streams import GROUND_TRUTH, SECOND, Stream, copied, streams
from rig_identification.check.stamps.told import PRICE, devices_of, found, owner, quantity
from rig_identification.raw import RawSession

ORDER = 55

#: s; stamps come so soon before their receipt.
_SOON = 0.1
#: Nats a recording for an offset so near to one that scales have, where one of any size within a day is as
#: likely.
_NATS = math.log(86400.0 / (2.0 * len(SCALES) * 2.0 * _SOON))


@dataclass(frozen=True)
class _Clock:
    """The devices' clock in one recording."""

    name: str
    offset: float  # s, after the recorder's
    start: float  # s, first stamp


def find(session: RawSession) -> tuple[Found, ...]:
    """The one clock of all devices, where it is another than the recorder's in every recording."""
    clocks = [_clock(r.name, list(streams(session, place))) for place, r in enumerate(session.recordings)]
    known = [clock for clock in clocks if clock is not None]
    if not known or len(known) < len(clocks):
        return ()
    scales = {known_offset(clock.offset) for clock in known}
    exact = scales.pop() if len(scales) == 1 else None
    if exact is not None and all(abs(clock.offset - exact) < _SOON for clock in known):
        gain = _NATS * len(known)
        return (_told(session, known, "leap_seconds", exact, gain),) if gain > PRICE else ()
    if all(c.start < SINCE_START / SECOND <= c.start - c.offset for c in known):
        kind = "simulated_stamps" if min(c.start for c in known) < 60.0 else "other_clock"
        # Stamps of before 1980, received later by the recorder's clock: there is no chance in that
        offset = float(np.median([c.offset for c in known]))
        return (_told(session, known, kind, offset, 2.0 * PRICE),)
    return ()


def _clock(name: str, here: list[Stream]) -> _Clock | None:
    """The clock that the devices of a recording share, None where they do not or receipts do not tell."""
    devices = [s for s in here if s.device != GROUND_TRUTH]
    if len({s.device for s in devices}) < 2 or any(copied(s.channel) or not steady(s) for s in devices):
        return None
    if not all(received_together(s, [o for o in devices if o.device != s.device]) for s in devices):
        return None
    offsets = [-latency(s.stamps, s.received) for s in devices]
    if np.ptp(offsets) > ORDINARY:
        return None
    start = min(int(s.stamps.min()) for s in devices) / SECOND
    return _Clock(name, float(np.median(offsets)), start)


def _told(session: RawSession, known: list[_Clock], kind: str, offset: float, gain: float) -> Found:
    devices = devices_of(session)
    side = "ahead of" if offset > 0 else "behind"
    if kind == "leap_seconds":
        scale = SCALES.get(abs(offset), "the time of another zone")
        what = f"stamps are {abs(offset):g} s {side} the recorder's clock: they are in {scale}, not in UTC"
    else:
        start = min(c.start for c in known)
        what = f"stamps start at {start:.3f} s, while the recorder's clock shows the time of day"
        what += ": they are simulated, or count from a start"
    return found(
        session, session, devices, kind, [clock.name for clock in known],
        parameters={"offset": quantity(offset, 0.0 if kind == "leap_seconds" else _SOON, "s")},
        statement=f"{owner(session, devices)} {what}. They agree with each other: nothing is corrected.",
        advice=ADVICE[kind],
        gain=gain,
    )  # fmt: skip
