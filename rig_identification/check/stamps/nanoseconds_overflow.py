"""Stamps that come from too small an integer: they wrap around, every 4.29 s for nanoseconds in 32 bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.common_clock import placement, received_together, steady
from rig_identification.check.stamps.continuity import gain_of
from rig_identification.check.stamps.mended import Mended, groups, mended_streams, names
from rig_identification.check.stamps.regular import seconds, usual_interval
from rig_identification.check.stamps.streams import FEWEST, SECOND, Stream, copied, streams, with_stamps
from rig_identification.check.stamps.told import found, owner, quantity, recordings_text
from rig_identification.raw import RawSession, Stamps

ORDER = 10

_BITS_32 = 2**32
#: Steps back and forth by one period from which they are no clock's.
_BACK_AND_FORTH = 4
#: Periods (ns) of counters that wrap around, and what they count.
_PERIODS = {
    _BITS_32: "nanoseconds in 32 bits",
    2**31: "nanoseconds in 31 bits",
    SECOND: "nanoseconds without their seconds",
    1000 * _BITS_32: "microseconds in 32 bits",
    60 * SECOND: "seconds without their minutes",
    3600 * SECOND: "the time within the hour",
    86400 * SECOND: "the time of day",
}


@dataclass(frozen=True)
class _Unwrapped:
    stamps: Stamps
    period: int


def find(session: RawSession) -> tuple[Found, ...]:
    """Streams whose stamps wrap around, put on the clock of the others."""
    by_device = mended_streams(session, _mend)
    result = []
    for devices in groups(by_device):
        some = [one for device in sorted(devices) for one in by_device[device]]
        some += _short_ones(session, devices, some)
        session = _anchored(session, some)
        result.append(_told(session, devices, some))
    return tuple(result)


def _mend(stream: Stream) -> Mended | None:
    tried = [_unwrapped(stream.stamps, period) for period in _PERIODS]
    tried += [_low_part(stream.stamps, lowest) for lowest in (0, -(2**31))]
    best: Mended | None = None
    for one in tried:
        if one is not None and np.any(one.stamps != stream.stamps):
            gain = gain_of(stream.stamps, one.stamps)
            if best is None or gain > best.gain:
                best = Mended(stream, one.stamps, gain, {"period": one.period})
    return best


def _unwrapped(stamps: Stamps, period: int) -> _Unwrapped | None:
    """Stamps with a period added at every step back by about one.

    They stay within a period, or have the seconds right and a fraction that is negative in half of each.
    """
    steps = np.diff(stamps)
    turns = np.where(np.abs(steps) > 0.9 * period, np.round(-steps / period), 0).astype(np.int64)
    added = np.concatenate(([0], np.cumsum(turns)))
    if not turns.any() or np.abs(turns).max() > 1:
        return None
    back_and_forth = np.ptp(added) == 1 and np.count_nonzero(turns) >= _BACK_AND_FORTH
    if np.ptp(stamps) > 1.01 * period and not back_and_forth:
        return None
    if back_and_forth and added.min() < 0:
        added += 1  # the side without a period taken off is right
    return _Unwrapped(stamps + period * added, period)


def _low_part(stamps: Stamps, lowest: int) -> _Unwrapped | None:
    """Right seconds with, as nanoseconds, the low 32 bits of all nanoseconds since 1970.

    A stamp is then S + (t mod 2^32) for the time t in second S, the remainder from ``lowest`` on. Each
    second that it may have been gives at most one t; the samples with a single one tell which of the others'
    is right.
    """
    whole = stamps // SECOND
    choices = []
    for back in range(lowest // SECOND - 1, (lowest + _BITS_32) // SECOND + 1):
        second = (whole - back) * SECOND
        low = stamps - second
        fraction = (low - second) % _BITS_32
        fits = (low >= lowest) & (low < lowest + _BITS_32) & (fraction < SECOND)
        choices.append(np.where(fits, second + fraction, -1))
    table = np.array(choices)
    possible = table >= 0
    single = np.flatnonzero(possible.sum(axis=0) == 1)
    if not possible.any(axis=0).all() or len(single) < FEWEST:
        return None
    known = table.max(axis=0)[single]
    base = known[0]
    expected = np.interp(np.arange(len(stamps)), single, (known - base).astype(np.float64))
    distance = np.where(possible, np.abs((table - base) - expected), np.inf)
    chosen = table[np.argmin(distance, axis=0), np.arange(len(stamps))]
    return _Unwrapped(chosen, _BITS_32)


def _short_ones(session: RawSession, devices: frozenset[str], some: list[Mended]) -> list[Mended]:
    """Streams of the same devices that are too short to wrap, but hold what the counter holds."""
    period = max(int(one.facts["period"]) for one in some)
    if min(int(one.stream.stamps.max()) for one in some) > 2 * period:
        return []  # the seconds are right
    have = {one.stream.key for one in some}
    rest = [s for s in streams(session) if s.device in devices and s.key not in have]
    return [Mended(s, s.stamps, 0.0, {"period": period}) for s in rest if abs(s.stamps).max() <= period]


def _anchored(session: RawSession, some: list[Mended]) -> RawSession:
    """The session with the streams unwrapped, and shifted by whole periods to where the others are."""
    stamps = {}
    for one in some:
        here = list(streams(session, one.stream.place))
        wrong = {other.stream.key for other in some if other.stream.key not in stamps}
        others = [other for other in here if other.key not in wrong]
        shifted = with_stamps(session, {one.stream.key: one.stamps})
        alone = next(s for s in streams(shifted, one.stream.place) if s.key == one.stream.key)
        placed = placement(alone, others, one.stream)
        period = int(one.facts["period"])
        ahead = _ahead(alone, here, one.stream, period) if placed is None else round(placed.offset * SECOND)
        turns = round(ahead / period)
        stamps[one.stream.key] = one.stamps - turns * period
        session = with_stamps(session, {one.stream.key: stamps[one.stream.key]})
    return session


def _ahead(alone: Stream, here: list[Stream], recorded: Stream, period: int) -> int:
    """ns by which the first stream to be placed is ahead of its receipts, or of the first period."""
    others = [other for other in here if other.key != alone.key]
    if not copied(recorded.channel) and steady(alone) and received_together(alone, others):
        return int(np.median(alone.stamps - alone.received))
    return (int(alone.stamps.min()) - 1) // period * period


def _told(session: RawSession, devices: frozenset[str], some: list[Mended]) -> Found:
    period = int(some[0].facts["period"])
    wraps = sum(int(np.count_nonzero(np.diff(one.stream.stamps) < -0.5 * period)) for one in some)
    where = names(some)
    interval = max(usual_interval(seconds(one.stamps)) for one in some)
    return found(
        session, session, devices, "nanoseconds_overflow", where,
        parameters={"period": quantity(period / SECOND, 0.0, "s"), "interval": quantity(interval, 0.0, "s")},
        statement=f"{owner(session, devices)} stamps hold {_PERIODS[period]}: they wrap around every "
        f"{period / SECOND:.4g} s, {wraps} times{recordings_text(session, where)}.",
        advice="Count nanoseconds in 64 bits in the driver, and split them into sec and nanosec only then "
        "(nanosec stays below 1,000,000,000).",
        gain=sum(one.gain for one in some),
    )  # fmt: skip
