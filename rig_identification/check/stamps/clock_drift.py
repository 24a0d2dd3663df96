"""A device's clock that runs fast or slow against the others'."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.found import Found
from rig_identification.check.stamps.common_clock import received_together
from rig_identification.check.stamps.streams import GROUND_TRUTH, SECOND, Stream, streams, with_stamps
from rig_identification.check.stamps.told import PRICE, found, owner, quantity, recordings_text
from rig_identification.raw import RawSession, Stamps

ORDER = 90

Array = NDArray[np.float64]

#: Crystals differ by tens of ppm; the fit's doubt of clocks covers what 50 ppm make of half a minute.
_ORDINARY = 50e-6
#: ppm that a slow change of latency by 0.2 ms over half a minute makes.
_LEAST_STD = 5e-6
#: Receive times that run this much faster or slower than the stamps are a conversion's, not a clock's.
_NO_CLOCK = 0.01
#: Parts of a recording in which a latency is taken.
_PARTS = 24
#: Samples in a part from which its median is told.
_FEWEST = 4
#: s; latencies of devices differ by this, and an offset beyond it at the start is taken out as well.
_LATENCIES = 0.005


@dataclass(frozen=True)
class _Drift:
    """Rate of a stream's clock against the recording's others."""

    stream: Stream
    rate: float  # 1, positive: fast
    std: float
    start_ns: int  # stamp at which it is taken to be right
    offset: float  # s, of that stamp against the others beyond what latencies explain


def find(session: RawSession) -> tuple[Found, ...]:
    """Devices whose clocks run at another rate by receive times or spans, put at the rate of the others."""
    by_device: dict[str, list[_Drift]] = defaultdict(list)
    for place in range(len(session.recordings)):
        for drift in _by_receipt(list(streams(session, place))):
            by_device[drift.stream.device].append(drift)
    result = []
    for device, some in sorted(by_device.items()):
        rate, std = _common(some)
        beyond = max(abs(rate) - _ORDINARY, 0.0)
        gain = 0.5 * (beyond / std) ** 2
        if device == GROUND_TRUTH or gain <= PRICE:
            continue
        session = with_stamps(session, {one.stream.key: _at_rate(one, rate) for one in some})
        result.append(_told(session, device, some, rate, std, gain))
    return tuple(result)


def _by_receipt(here: list[Stream]) -> list[_Drift]:
    """Rates by the stamps' advance over receive times, against the median of the streams."""
    if len({s.device for s in here if s.device != GROUND_TRUTH}) < 2:
        return []
    here = [s for s in here if received_together(s, [o for o in here if o.key != s.key])]
    devices = [s for s in here if s.device != GROUND_TRUTH]
    if len(devices) < 2:
        return []
    origin = min(int(s.received[0]) for s in here)
    low = max(int(s.received.min()) for s in devices) - origin
    high = min(int(s.received.max()) for s in devices) - origin
    if high - low <= 0:
        return []
    edges = np.linspace(low, high, _PARTS + 1)
    table = {s.key: _advance(s, origin, edges) for s in here}
    rows = np.array([table[s.key] for s in devices])
    if np.isnan(rows).all(axis=0).any():
        return []
    middle = np.nanmedian(rows, axis=0)
    if not abs(_slope(edges, middle)[0]) < _NO_CLOCK:
        return []
    if len({s.device for s in devices}) == 2:
        steadiest = min(devices, key=lambda s: abs(_slope(edges, table[s.key])[0]))
        middle = table[steadiest.key]
    seen = [ahead[np.isfinite(ahead)] for ahead in (table[s.key] - middle for s in devices)]
    usual = float(np.median([np.median(ahead) for ahead in seen if len(ahead)] or [0.0]))
    result = []
    for stream in here:
        rate, std, start = _slope(edges, table[stream.key] - middle)
        if np.isfinite(rate):
            offset = start - usual
            result.append(
                _Drift(stream, rate, std, int(stream.stamps[0]), offset if abs(offset) > _LATENCIES else 0.0)
            )
    return result


def _advance(stream: Stream, origin: int, edges: Array) -> Array:
    """(parts,) s, median stamp less receive time in each part of the recording."""
    ahead = (stream.stamps - stream.received).astype(np.float64) / SECOND
    part = np.searchsorted(edges, (stream.received - origin).astype(np.float64), side="right") - 1
    result = np.full(len(edges) - 1, np.nan)
    for number in range(len(result)):
        own = ahead[part == number]
        if len(own) >= _FEWEST:
            result[number] = np.median(own)
    return result


def _slope(edges: Array, ahead: Array) -> tuple[float, float, float]:
    """Slope (1) by least squares over the parts, its std, and the line's value (s) at the start."""
    seen = np.isfinite(ahead)
    if np.count_nonzero(seen) < _PARTS // 2:
        return np.nan, np.nan, np.nan
    middle = (edges[1:] + edges[:-1])[seen] / 2.0 / SECOND
    design = np.column_stack((np.ones(len(middle)), middle - edges[0] / SECOND))
    fit, *_ = np.linalg.lstsq(design, ahead[seen], rcond=None)
    rest = ahead[seen] - design @ fit
    variance = float(rest @ rest) / (len(rest) - 2) * np.linalg.inv(design.T @ design)[1, 1]
    return float(fit[1]), max(float(np.sqrt(variance)), _LEAST_STD), float(fit[0])


def _common(some: list[_Drift]) -> tuple[float, float]:
    """The rate of one clock over all recordings, and its std widened by how far these disagree."""
    rates, weights = np.array([one.rate for one in some]), np.array([one.std**-2 for one in some])
    rate = float(np.sum(weights * rates) / np.sum(weights))
    std = float(np.sum(weights) ** -0.5)
    if len(some) > 1:
        std *= max(1.0, float(np.sqrt(np.sum(weights * (rates - rate) ** 2) / (len(some) - 1))))
    return rate, std


def _at_rate(one: _Drift, rate: float) -> Stamps:
    since = (one.stream.stamps - one.start_ns).astype(np.float64)
    shift = since * (rate / (1.0 + rate)) + one.offset * SECOND
    return one.stream.stamps - np.round(shift).astype(np.int64)


def _told(
    session: RawSession, device: str, some: list[_Drift], rate: float, std: float, gain: float
) -> Found:
    devices = frozenset({device})
    where = [session.recordings[place].name for place in sorted({one.stream.place for one in some})]
    longest = max(float(np.ptp(one.stream.stamps)) for one in some) / SECOND
    return found(
        session, session, devices, "clock_drift", where,
        parameters={
            "drift": quantity(1e6 * rate, 1e6 * std, "ppm"),
            "delay": quantity(0.0, max(longest * std, 1e-3), "s"),
        },
        statement=f"{owner(session, devices)} clock runs {abs(1e6 * rate):,.0f} ppm "
        f"{'fast' if rate > 0 else 'slow'}{recordings_text(session, where)}: "
        f"{1e3 * abs(rate) * longest:.3g} ms over {longest:.3g} s.",
        advice="Synchronize the device's clock while it records (PTP, NTP), or stamp its samples by the "
        "recording computer's clock.",
        gain=gain,
    )  # fmt: skip
