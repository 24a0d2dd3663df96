"""A device whose readings err in a cycle: one in every few samples is made otherwise than its neighbours.

An angle that is integrated from a gyroscope and corrected at every fifth sample, pictures of two cameras in
turn, converters in turn, a stamp that is late once in a cycle: with n samples in a cycle, sample k errs as
sample k + n does. In the spectrum of what is left that makes lines at multiples of 1 / n of the rate.

The mean over a whole cycle has no such error but a constant one, and where the samples' stamps err in turn as
well a constant delay. So means over whole cycles take the samples' place. Of a smooth signal x the mean over
samples a step h apart is x + v/2 x'', v = h^2 (n^2 - 1) / 12 the variance of their times, and this curvature
is put back: of a sine at angular frequency w (w n h)^4 / 1920 of the amplitude stays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import (
    FALSE_ALARM,
    Array,
    Indices,
    groups,
    interval,
)
from rig_identification.check.readings.telling import (
    Spotted,
    devices_of,
    listed,
    of_recordings,
    told_of,
    where,
)
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawSession

#: After repeated samples are gone (10) and averages undone (60).
ORDER = 70
#: Samples of a cycle that is looked for, at most, and cycles that a recording holds at least.
_LONGEST, _CYCLES = 16, 24
#: A cycle is this part of the swing's period at most: what its mean leaves of the amplitude is 2e-4 then.
_SHORT = 0.125
#: Below half the noise of a sample a cycle raises what is left by an eighth, and bends nothing.
_HARMFUL = 0.5
#: Share by which the cycle of a recording's two halves may differ beside their own noise.
_STEADY = 0.3
#: Share of a cycle's power in a single line of several above which it is a tone, the mains for one.
_TONE = 0.9
#: Devices of which a mean over some samples is a reading. Of quaternions close together it is the mean turn.
_AVERAGED = ("tension", "imu", "inclination", "mocap")
#: Cells in turn on one converter have one cycle.
_SAME = 0.02


@dataclass(frozen=True)
class _Cycle:
    """What the samples of one column err by, in turn."""

    samples: int
    gain: float  # nats against no cycle, less what is won by chance


def find(session: RawSession) -> tuple[Found, ...]:
    """Channels whose samples err in a cycle; means over whole cycles take their place."""
    return told_of(session, _AVERAGED, _spotted, _fault, tolerance=_SAME)


def _spotted(recorded: list[tuple[int, RawChannel]]) -> list[Spotted]:
    cycles = {number: _cycle(channel) for number, channel in recorded}
    shown = [cycle for cycle in cycles.values() if cycle is not None]
    lengths = {cycle.samples for cycle in shown}
    long = [number for number, channel in recorded if len(channel.stamp_ns) > _CYCLES * _LONGEST]
    # A device's cycle is its own: it is one and the same wherever the recording is long enough to tell
    if len(lengths) != 1 or any(cycles[number] is None for number in long):
        return []
    samples, gain = lengths.pop(), sum(cycle.gain for cycle in shown)
    out = []
    for number, channel in recorded:
        if len(channel.stamp_ns) > 4 * samples:
            changed = _averaged(channel, samples)
            seconds = samples * interval(channel)
            count = len(channel.stamp_ns)
            out.append(
                Spotted(
                    channel.device, channel.channel, number, changed,
                    count=count, gain=gain / len(recorded), value=seconds,
                )
            )  # fmt: skip
    return out


def _cycle(channel: RawChannel) -> _Cycle | None:
    """The cycle of a channel's quantities; None where none shows."""
    columns = [k for kept in groups(channel).values() for k in kept]
    places = _places(channel)
    found = [cycle for k in columns if (cycle := _of_column(channel.values[:, k], places)) is not None]
    return max(found, key=lambda cycle: cycle.gain) if found else None


def _places(channel: RawChannel) -> Indices:
    """(n,) number of each sample by its stamp, so that a lost one shifts no cycle."""
    step = interval(channel)
    if step <= 0.0:
        return np.arange(len(channel.stamp_ns))
    return np.asarray(np.rint((channel.stamp_ns - channel.stamp_ns[0]) / (step * 1e9)), dtype=np.int64)


def _of_column(column: Array, places: Indices) -> _Cycle | None:
    """The likeliest cycle of a column (n,) that is neither chance nor motion nor a tone."""
    known = np.isfinite(column)
    values, places = column[known], places[known]
    if values.size < _CYCLES * 2:
        return None
    period = _swing(values)
    tried = [
        cycle
        for n in range(2, min(_LONGEST, values.size // _CYCLES, int(_SHORT * period)) + 1)
        if (cycle := _of_length(values, places, n)) is not None
    ]
    return max(tried, key=lambda cycle: cycle.gain) if tried else None


def _swing(values: Array) -> float:
    """Samples in a period of the strongest line."""
    power = np.abs(np.fft.rfft((values - np.mean(values)) * np.hanning(values.size))) ** 2
    return values.size / (int(np.argmax(power[1:])) + 1)


def _of_length(values: Array, places: Indices, n: int) -> _Cycle | None:
    """Whether what a mean over a cycle does not follow repeats after ``n`` samples."""
    left, at = _left(values, places, n)
    phase = at % n
    count = np.bincount(phase, minlength=n)
    if left.size < _CYCLES * n or np.min(count) < _CYCLES // 2:
        return None
    halves = [
        _pattern(left[part], phase[part], n) for part in (slice(left.size // 2), slice(left.size // 2, None))
    ]
    pattern = _pattern(left, phase, n)
    noise = float(np.var(left - pattern[phase]))
    size = float(np.sum(count * pattern**2)) / left.size
    # What both means leave of white noise's variance: a pattern by chance has (n - 1) / count of it
    gain = 0.5 * left.size * float(np.log1p(size / max(noise, 1e-300)))
    gain -= 0.5 * (n - 1) * float(np.log(left.size)) - float(np.log(FALSE_ALARM / _LONGEST))
    apart = float(np.sum((halves[0] - halves[1]) ** 2)) - 4.0 * n * noise / float(np.min(count))
    steady = apart < _STEADY**2 * float(np.sum(pattern**2))
    if gain <= 0.0 or not steady or size < _HARMFUL**2 * noise or _is_tone(pattern):
        return None
    return _Cycle(n, gain)


def _left(values: Array, places: Indices, n: int) -> tuple[Array, Indices]:
    """What a centred mean over ``n`` samples does not follow, its curvature put back, and the places of that.

    Of an even number the mean is over n + 1 samples, the outermost two counted half: it is centred, too.
    """
    weights = np.ones(n) if n % 2 else np.concatenate([[0.5], np.ones(n - 1), [0.5]])
    weights = weights / n
    width = weights.size
    offsets = np.arange(width) - width // 2
    mean = sliding_window_view(values, width) @ weights
    middle = slice(width // 2, width // 2 + mean.size)
    left, at = values[middle] - mean, places[middle]
    whole = sliding_window_view(places, width)
    even = whole[:, -1] - whole[:, 0] == width - 1
    # The mean is high by v/2 of the second difference over a cycle either way, by n^2
    spread = float(np.sum(weights * offsets**2))
    if left.size <= 2 * n:
        return left[:0], at[:0]
    curved = np.zeros_like(left)
    curved[n:-n] = 0.5 * spread * (mean[2 * n :] - 2.0 * mean[n:-n] + mean[: -2 * n]) / n**2
    good = even.copy()
    good[n:-n] &= even[2 * n :] & even[: -2 * n]
    good[:n] = good[-n:] = False
    return (left + curved)[good], at[good]


def _pattern(left: Array, phase: Indices, n: int) -> Array:
    """(n,) mean of each sample of a cycle, less the mean of all."""
    mean = np.bincount(phase, left, n) / np.maximum(np.bincount(phase, minlength=n), 1)
    return np.asarray(mean - np.mean(mean))


def _is_tone(pattern: Array) -> bool:
    """Whether a cycle is a single line of several that it might have."""
    power = np.abs(np.fft.rfft(pattern))[1:] ** 2
    return bool(power.size > 1 and np.max(power) > _TONE * np.sum(power))


def _averaged(channel: RawChannel, n: int) -> RawChannel:
    """The channel as means over its whole cycles."""
    places = _places(channel)
    number = (places - places[0]) // n
    first = np.searchsorted(number, np.arange(int(number[-1]) + 1))
    whole = first[(first + n <= number.size)]
    begun = (places[whole] - places[0]) % n == 0
    whole = whole[begun & (places[whole + n - 1] - places[whole] == n - 1)]
    each = whole[:, None] + np.arange(n)
    values = np.mean(_one_sign(channel)[each], axis=1)
    stamps = channel.stamp_ns[each]
    taken = stamps[:, 0] + np.rint(np.mean(stamps - stamps[:, :1], axis=1)).astype(np.int64)
    beside = np.diff(whole) == n
    bends = np.zeros_like(values)
    inner = beside[1:] & beside[:-1]
    second = np.diff(values, 2, axis=0)
    bends[1:-1][inner] = second[inner]
    spread = (n**2 - 1) / 12.0
    return replace(
        channel,
        stamp_ns=taken,
        received_ns=channel.received_ns[each[:, -1]],
        values=values - 0.5 * spread * bends / n**2,
    )


def _one_sign(channel: RawChannel) -> Array:
    """(n, w) values; of quaternions the sign that is nearer to the sample before."""
    values = channel.values
    if channel.channel != "mocap":
        return values
    turned = np.sum(values[1:, 3:] * values[:-1, 3:], axis=1) < 0.0
    values = values.copy()
    values[:, 3:] *= np.cumprod(np.concatenate([[1.0], np.where(turned, -1.0, 1.0)]))[:, None]
    return np.asarray(values)


def _fault(session: RawSession, group: list[Spotted]) -> SetupFault:
    names = devices_of(group)
    seconds = float(np.median([one.value for one in group]))
    rate = 1.0 / seconds
    samples = round(sum(one.count for one in group) / max(1, sum(len(o.changed.stamp_ns) for o in group)))
    statement = (
        f"{listed(names)} read{'s' if len(names) == 1 else ''} with errors that come back every {samples} "
        f"samples ({seconds:.4g} s). Means over {samples} samples are used in "
        f"{of_recordings(session, group)}."
    )
    advice = (
        "Record what the sensor itself reads: something corrects, or takes in turn, one in every "
        f"{samples} samples, a filter that fuses two sensors or two cameras for one."
    )
    return SetupFault(
        "cycling_samples", where(session, group),
        {
            "samples": {"value": float(samples), "std": 0.0, "unit": "1"},
            "rate": {"value": rate, "std": 0.0, "unit": "Hz"},
        },
        statement, advice, "", True, sum(one.gain for one in group),
    )  # fmt: skip
