"""A reading that stays exactly the same while its own noise, or the body's motion, would change it.

A converter with noise of a step or more does not repeat itself for long: the chance of a run follows from
noise and step. A channel that never changes at all is frozen where its own noise is known from another
recording, or where the other devices see the body move.
"""

from __future__ import annotations

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import (
    Array,
    Flags,
    channels_of,
    groups,
    interval,
    longest_by_chance,
    repeats,
    resolution,
    runs,
    same_by_chance,
    seconds,
)
from rig_identification.check.readings.telling import (
    Spotted,
    devices_of,
    listed,
    of_recordings,
    spans_of,
    start_ns,
    together,
    told,
    where,
    without,
)
from rig_identification.cleaning.clipping import limits
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession

ORDER = 30
#: A body moves where a tension changes by this share, ...
_TENSION_MOVES = 0.05
#: ... an angular rate by this, ...
_RATE_MOVES = 0.02  # rad/s
#: ... or a tracked point by this: ten times what a tracker's noise and a coarse cell make.
_POINT_MOVES = 0.005  # m
#: A converter so coarse that motion is this few steps may rest on one of them.
_MOTION_STEPS = 20
#: Devices that the body's motion must change.
_MUST_MOVE = ("tension", "imu", "mocap")
#: An inclinometer does not see a body that turns about the vertical; where tensions change, it tilts.
_TILTS = ("inclination",)
#: A message sent again once or twice does no harm and is no device that freezes.
_RUN = 4
#: Steps behind a run with which the step out of it is compared, and how much wider what was missed is: noise
#: makes no step twice as wide as the widest of nine.
_BESIDE, _FAR = 10, 2.0
#: Fewer samples than this are no channel to judge.
_SHORTEST = 50


def find(session: RawSession) -> tuple[Found, ...]:
    """Channels that freeze; the repeated samples are left out, all of them where nothing else is recorded."""
    spotted = [one for (_, _), recorded in channels_of(session) for one in _spotted(session, recorded)]
    return told(session, _at_one_time(spotted), _fault)


def _at_one_time(spotted: list[Spotted]) -> list[list[Spotted]]:
    """One fault a device; cells that freeze over the same times are one."""
    out: list[list[Spotted]] = []
    for device in together(spotted, tolerance=-1.0):
        for group in out:
            if all(one.channel == "tension" for one in (group[0], device[0])) and _same(group, device):
                group.extend(device)
                break
        else:
            out.append(list(device))
    return out


def _same(one: list[Spotted], other: list[Spotted]) -> bool:
    first = [s for s in one if s.device == one[0].device]
    if [s.recording for s in first] != [s.recording for s in other]:
        return False
    pairs = [(a.spans, b.spans) for a, b in zip(first, other, strict=True)]
    return all(len(a) == len(b) and np.allclose(a, b, atol=0.1) for a, b in pairs)


def _spotted(session: RawSession, recorded: list[tuple[int, RawChannel]]) -> list[Spotted]:
    varying: dict[str, set[int]] = {}
    for _, channel in recorded:
        for quantity, kept in groups(channel).items():
            varying.setdefault(quantity, set()).update(kept)
    watched = [tuple(sorted(kept)) for kept in varying.values()]
    chances = [_chance(recorded, columns) for columns in watched]
    ends = _limits(recorded)
    out = []
    for number, channel in recorded:
        frozen, gain = np.zeros(len(channel.values), bool), 0.0
        if not groups(channel) and any(np.any(channel.values[:1] == end) for end in ends):
            continue
        for columns, chance in zip(watched, chances, strict=True):
            flags, nats = _frozen(channel, columns, chance)
            frozen, gain = frozen | flags, gain + nats
        if not frozen.any() and _stands_still(channel) and _moves(session.recordings[number], channel):
            frozen, gain = np.ones(len(channel.values), bool), float(len(channel.values))
        if frozen.any():
            whole = np.count_nonzero(~frozen & np.isfinite(channel.values).any(axis=1)) <= 1
            frozen |= whole
            times = seconds(channel, start_ns(session.recordings[number]))
            out.append(
                Spotted(
                    channel.device, channel.channel, number, without(channel, frozen),
                    spans_of(frozen, times), int(np.count_nonzero(frozen)), gain, float(whole),
                )
            )  # fmt: skip
    return out


def _limits(recorded: list[tuple[int, RawChannel]]) -> set[float]:
    """Values at which another recording of a channel of one column is stuck: ends of its range."""
    known: set[float] = set()
    for _, channel in recorded:
        finite = channel.values[np.isfinite(channel.values).all(axis=1)]
        known |= {end.value for end in limits(finite)} if len(finite) and finite.shape[1] == 1 else set()
    return known


def _chance(recorded: list[tuple[int, RawChannel]], columns: tuple[int, ...]) -> float:
    """Of a sample to equal the one before, at most, by the recording in which noise tells the least."""
    known = [same_by_chance(channel.values, columns) for _, channel in recorded]
    return max((chance for chance in known if chance < 1.0), default=1.0)


def _frozen(channel: RawChannel, columns: tuple[int, ...], chance: float) -> tuple[Flags, float]:
    """(n,) which samples repeat one that was measured too often for chance, and the nats for it."""
    values, frozen, gain = channel.values, np.zeros(len(channel.values), bool), 0.0
    longest = max(_RUN, longest_by_chance(len(values), chance))
    if not np.isfinite(longest):
        return frozen, gain
    for a, b in zip(*runs(repeats(values, columns)), strict=True):
        # A slack cable's 0 repeats as well
        if b - a < longest or not np.any(values[a, list(columns)]):
            continue
        if len(columns) == 1 and _at_end_of_range(values[:, columns[0]], int(a), int(b)):
            continue
        frozen[a:b] = True
        gain -= float((b - a) * np.log(chance) + np.log(len(values)))
    return frozen, gain


def _at_end_of_range(column: Array, a: int, b: int) -> bool:
    """Whether a run column[a - 1 : b] of one value is a signal cut at the end of a range.

    Such a run has the largest or the smallest value of all. Noise brings the signal there before and after,
    or it comes back smoothly; what was frozen is there once, and goes on elsewhere or not at all.
    """
    value = column[a]
    if value not in (np.nanmin(column), np.nanmax(column)):
        return False
    if np.count_nonzero(column == value) > b - a + 1:
        return True
    behind = column[b : b + _BESIDE]
    if len(behind) < _BESIDE:
        return len(behind) > 1
    return bool(abs(behind[0] - value) <= _FAR * np.nanmax(np.abs(np.diff(behind))))


def _stands_still(channel: RawChannel) -> bool:
    """Whether a channel that motion must change reads one value, not 0, in the whole recording."""
    values = channel.values[np.isfinite(channel.values).any(axis=1)]
    return (
        channel.channel in (*_MUST_MOVE, *_TILTS)
        and len(values) >= _SHORTEST
        and not groups(channel)
        and bool(np.nanmax(np.abs(values)) > 0.0)
    )


def _moves(recording: RawRecording, still: RawChannel) -> bool:
    """Whether another device of the recording sees the body move."""
    for channel in recording.channels:
        sees = ("tension",) if still.channel in _TILTS else _MUST_MOVE
        if channel.topic == still.topic or channel.channel not in sees or not len(channel.values):
            continue
        columns = groups(channel)
        watched = {"tension": (0,), "imu": (0, 1, 2), "mocap": (0, 1, 2)}[channel.channel]
        for k in [k for kept in columns.values() for k in kept if k in watched]:
            column = channel.values[np.isfinite(channel.values[:, k]), k]
            least = {"imu": _RATE_MOVES, "mocap": _POINT_MOVES}.get(
                channel.channel, _TENSION_MOVES * abs(float(np.median(column)))
            )
            # Single damaged values are no motion
            low, high = np.percentile(column, (5.0, 95.0))
            if high - low > max(least, _MOTION_STEPS * resolution(column)):
                return recording.kind == "dynamic"
    return False


def _fault(session: RawSession, group: list[Spotted]) -> SetupFault:
    names, whole = devices_of(group), all(one.value for one in group)
    count = sum(one.count for one in group)
    verb = "stays" if len(names) == 1 else "stay"
    how = "throughout" if whole else f"for {_total(group):.3g} s in all"
    left = "The channel is left out there." if whole else f"These {count} samples are left out."
    return SetupFault(
        "frozen_channel", where(session, group), {"count": {"value": count, "std": 0.0, "unit": "1"}},
        f"{listed(names)} {verb} at exactly one value {how} in {of_recordings(session, group)}, where noise "
        f"or the body's motion would change it. {left}",
        "Look at the device's supply, cable and driver; let it publish no message without a new reading.",
        "", not whole, sum(one.gain for one in group),
    )  # fmt: skip


def _total(group: list[Spotted]) -> float:
    """Seconds that the device froze, the mean over several."""
    return sum(one.count * interval(one.changed) for one in group) / len(devices_of(group))
