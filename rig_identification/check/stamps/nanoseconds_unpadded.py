"""Fractions of a second written without their leading zeros: 12.000000005 s as "12.5"."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.found import Found
from rig_identification.check.stamps.continuity import gain_of
from rig_identification.check.stamps.mended import Mended, names, undone
from rig_identification.check.stamps.regular import mean_interval, seconds
from rig_identification.check.stamps.streams import SECOND, Stream
from rig_identification.check.stamps.told import found, owner, quantity, recordings_text
from rig_identification.raw import RawSession, Stamps

ORDER = 20

Array = NDArray[np.float64]

#: A time in ns since 1970 has ten digits of seconds from 2001 to 2286.
_FIRST, _LAST = 10**18, 10**19
_DIGITS = 9


def find(session: RawSession) -> tuple[Found, ...]:
    """Streams whose fractions of a second lost their leading zeros, with the zeros put back."""
    return undone(session, _mend, _told)


def _mend(stream: Stream) -> Mended | None:
    best: Mended | None = None
    for stamps in (_padded(stream.stamps), _split_again(stream.stamps)):
        if stamps is not None and np.any(stamps != stream.stamps):
            gain = gain_of(stream.stamps, stamps)
            if best is None or gain > best.gain:
                best = Mended(
                    stream, stamps, gain, {"wrong": float(np.count_nonzero(stamps != stream.stamps))}
                )
    return best


def _padded(stamps: Stamps) -> Stamps | None:
    """Each fraction with as many zeros as continue the stream from its neighbours in the same second.

    Fractions from 0.1 s on are right: nine in ten of each second, which place the others by their number.
    """
    whole, fraction = np.divmod(stamps, SECOND)
    if np.any((fraction > 0) & (fraction < SECOND // 10)) or np.any(stamps <= 0):
        return None  # a fraction with a leading zero was written right
    interval = mean_interval(seconds(stamps))
    if interval <= 0.0:
        return None
    table = np.array([(fraction + 10**zeros // 2) // 10**zeros for zeros in range(_DIGITS)])
    since = (whole - whole[0]).astype(np.float64)
    expected = _expected(whole, since + fraction / SECOND, interval)
    for _ in range(2):
        distance = np.abs(table / SECOND + since - expected)
        chosen = table[np.argmin(distance, axis=0), np.arange(len(stamps))]
        # Once more, each from the samples about it: losses moved it against its whole second.
        expected = _smoothed(since + chosen / SECOND)
    return np.asarray(whole * SECOND + chosen, np.int64)


def _expected(whole: Stamps, times: Array, interval: float) -> Array:
    """(n,) s at which each sample is expected: by its number, from the samples of its second.

    A second with less than half of the usual samples (the first, the last) goes by those beside it.
    """
    count = np.arange(len(whole), dtype=np.float64)
    firsts = np.flatnonzero(np.diff(whole, prepend=whole[0] - 1))
    ends = np.append(firsts[1:], len(whole))
    rest = times - interval * count
    level = np.array([np.median(rest[a:b]) for a, b in zip(firsts, ends, strict=True)])
    full = np.flatnonzero(ends - firsts >= 0.5 * np.median(ends - firsts))
    number = np.arange(len(level))
    level = level[full[np.argmin(np.abs(number[:, None] - full), axis=1)]]
    return np.asarray(np.repeat(level, ends - firsts) + interval * count)


def _smoothed(times: Array) -> Array:
    """(n,) median over five samples of the times with the mean slope taken out."""
    slope = (times[-1] - times[0]) / (len(times) - 1) * np.arange(len(times))
    rest = np.pad(times - slope, 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(rest, 5), axis=1) + slope)


def _split_again(stamps: Stamps) -> Stamps | None:
    """Stamps read as one number from the digits of sec and of nanosec side by side."""
    short = (stamps > 0) & (stamps < _FIRST)
    if not short.any() or np.mean(short) > 0.5 or np.any(stamps >= _LAST):
        return None
    digits = np.floor(np.log10(np.maximum(stamps, 1).astype(np.float64)) + 1e-12).astype(np.int64) + 1
    behind = np.clip(digits - 10, 0, _DIGITS)
    whole, fraction = np.divmod(stamps, 10**behind)
    return np.where(short, whole * SECOND + fraction, stamps)


def _told(session: RawSession, devices: frozenset[str], some: list[Mended]) -> Found:
    where = names(some)
    wrong = int(sum(one.facts["wrong"] for one in some))
    every = sum(len(one.stamps) for one in some)
    return found(
        session, session, devices, "nanoseconds_unpadded", where,
        parameters={"wrong": quantity(wrong / every, 0.0, "1")},
        statement=f"{owner(session, devices)} stamps lost the leading zeros of their fraction of a second "
        f"(12.000000005 s as 12.5): {wrong:,} of {every:,} jump within their second"
        f"{recordings_text(session, where)}.",
        advice="Write nanoseconds with nine digits (%09d), or set sec and nanosec as two numbers.",
        gain=sum(one.gain for one in some),
    )  # fmt: skip
