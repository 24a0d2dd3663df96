"""Samples repeated: a device of a low rate is published at a higher one.

After a change of several converter steps the next sample is exactly the same, in all components, far more
often than noise and rounding bring it to within one step. A resting signal on a coarse converter repeats
too, but never after a change of several steps.

What is read off the pictures of a compressed film repeats to within a hair: the picture is the same, and
coded anew. Where nothing repeats exactly, that is looked for as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import bdtrc

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import (
    FALSE_ALARM,
    Array,
    Flags,
    channels_of,
    groups,
    interval,
    repeats,
    resolution,
)
from rig_identification.check.readings.held_stamps import steady
from rig_identification.check.readings.telling import (
    Spotted,
    devices_of,
    listed,
    only,
    together,
    told,
    where,
)
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawSession

ORDER = 10
#: Steps of the converter that a change must have: rounding makes one, noise below a step two.
_STEPS = 3
#: The density of differences is at most this many times higher at 0 than on average over _STEPS around it:
#: a normal distribution that reaches _STEPS with any use has exp(9 / 2 / 4) / 2 of it, rounded up.
_PEAK = 2.0
#: A switched signal has few values, a held one as many as there are holds.
_DISTINCT = 16
#: Of the changes of a signal held over two samples or more all are followed by a repeat, unless it is lost.
_HELD = 0.9
#: Held over less than two samples: runs that a free clock makes sum up to within one sample.
_RUNS = 32
#: Fewer repeats than one in ten do no harm: a sample late by one interval now and then.
_SELDOM = 0.1
#: A hair, as a share of the step that a signal takes in one sample of four or more.
_HAIR = 0.02
#: How often at most a step that follows a large one is no more than a hair without a fault: noise whose
#: density of steps is _PEAK times the mean one at 0, of which a hair either way is so much; rounded up.
_HAIR_BY_CHANCE = 0.1
#: Two cells on one logger are read at one rate.
_SAME_RATE = 0.02


@dataclass(frozen=True)
class _Hold:
    samples: float  # that one value is held, mean
    gain: float  # nats against a signal that is not held


@dataclass(frozen=True)
class _Changes:
    """What follows the large changes of one quantity."""

    events: int
    repeated: int
    chance: float  # of a repeat without a fault, at most
    distinct: int


def find(session: RawSession) -> tuple[Found, ...]:
    """Channels whose samples are repeated; each keeps the first sample of every hold."""
    spotted = []
    for _, recorded in channels_of(session):
        spotted += _spotted(session, recorded, exactly=True) or _spotted(session, recorded, exactly=False)
    return told(session, together(spotted, tolerance=_SAME_RATE), _fault)


def _spotted(session: RawSession, recorded: list[tuple[int, RawChannel]], *, exactly: bool) -> list[Spotted]:
    """Each recording of one channel, where at least one of them shows that it is held.

    exactly: samples that differ by a hair are not held.
    """
    least = 0.0 if exactly else _HAIR_BY_CHANCE

    def rows(channel: RawChannel, columns: tuple[int, ...]) -> Array:
        return channel.values if exactly else _combed(channel.values, columns)

    holds: list[tuple[str, _Hold]] = []
    contradicted: set[int] = set()
    for number, channel in recorded:
        for quantity, columns in groups(channel).items():
            values = rows(channel, columns)
            changes = _changes(values, columns, least)
            hold = _hold(values, columns, changes)
            if hold is not None:
                holds.append((quantity, hold))
            elif changes.events * _HELD > _DISTINCT and changes.repeated < 0.5 * changes.events:
                contradicted.add(number)
    slowest = _slowest(holds)
    if slowest is None:
        return []
    quantity, hold = slowest
    held: list[tuple[int, RawChannel, Flags, Flags]] = []
    for number, channel in recorded:
        shown = groups(channel).get(quantity)
        if shown is None:
            continue
        values = rows(channel, shown)
        if number in contradicted and _hold(values, shown, _changes(values, shown, least)) is None:
            continue
        same = repeats(values, shown)
        held.append((number, channel, _first_of_each(same, hold.samples), ~same))
    left_of = [only(channel, kept) for _, channel, kept, _ in held] if exactly else _of_film(held)
    out = []
    for (number, channel, _, _), left in zip(held, left_of, strict=True):
        rate = 1.0 / (hold.samples * interval(channel)) if interval(channel) else 0.0
        out.append(
            Spotted(
                channel.device, channel.channel, number, left,
                count=len(channel.stamp_ns) - len(left.stamp_ns), gain=hold.gain / len(recorded), value=rate,
            )
        )  # fmt: skip
    return out


def _of_film(held: list[tuple[int, RawChannel, Flags, Flags]]) -> list[RawChannel]:
    """The channels with the pictures that are new, stamped when they were taken.

    A film's stamps count its pictures, new or shown on. held: number of a recording, its channel, the samples
    kept, one for each time that the camera took a picture, and those that are new: within a hair of what it
    was no moving signal comes to rest, and a long hold is one picture where another was lost.
    """
    first = [only(channel, kept) for _, channel, kept, _ in held]
    between = float(np.median([interval(channel) for _, channel, _, _ in held])) if held else 0.0
    stamps = steady([one.stamp_ns for one in first], between)
    return [
        only(replace(one, stamp_ns=on_line), fresh[kept])
        for one, on_line, (_, _, kept, fresh) in zip(first, stamps, held, strict=True)
    ]


def _combed(values: Array, columns: tuple[int, ...]) -> Array:
    """The values with each sample that is within a hair of the one before it equal to that one."""
    chosen = np.array(columns, dtype=np.int64)
    steps = np.abs(np.diff(values[:, chosen], axis=0))
    if np.isnan(steps).all(axis=0).any():
        return values  # measured in turn with other numbers: no two samples stand beside each other
    near = np.all(steps <= _HAIR * np.nanpercentile(steps, 75.0, axis=0), axis=1)
    first = np.append(0, np.where(near, 0, np.arange(1, len(values))))
    combed = np.array(values)
    combed[:, chosen] = values[np.maximum.accumulate(first)][:, chosen]
    return combed


def _slowest(holds: list[tuple[str, _Hold]]) -> tuple[str, _Hold] | None:
    """The quantity held longest, with the evidence of all recordings for it."""
    if not holds:
        return None
    quantity = max(holds, key=lambda item: item[1].samples)[0]
    same = [hold for name, hold in holds if name == quantity]
    return quantity, _Hold(float(np.median([hold.samples for hold in same])), sum(hold.gain for hold in same))


def _changes(values: Array, columns: tuple[int, ...], least: float) -> _Changes:
    """What follows large changes. least: chance of a repeat, at least."""
    same = repeats(values, columns)
    large, chance = np.zeros(len(values), bool), 1.0
    steps = {k: resolution(values[:, k]) for k in columns}
    sizes = {k: np.abs(np.diff(values[:, k], prepend=np.nan)) for k in columns}
    for k in columns:
        large |= sizes[k] >= (_STEPS - 0.5) * steps[k] if steps[k] else False
    # What is filled with zeros, or at an end of range, is another fault, and it repeats
    large &= np.any(values[:, list(columns)] != 0.0, axis=1)
    for k in columns:
        large &= (values[:, k] != np.nanmax(values[:, k])) & (values[:, k] != np.nanmin(values[:, k]))
    event = np.flatnonzero(large[:-1])
    for k in columns:
        next_size = sizes[k][event + 1]
        near = np.count_nonzero((next_size > 0.0) & (next_size < (_STEPS + 0.5) * steps[k]))
        chance = min(chance, _PEAK * (near + 1) / (2 * _STEPS * max(len(event), 1)))
    distinct = len(np.unique(values[event, columns[0]])) if len(event) else 0
    distinct = max([distinct] + [len(np.unique(values[event, k])) for k in columns[1:]])
    return _Changes(len(event), int(np.count_nonzero(same[event + 1])), max(chance, least), distinct)


def _hold(values: Array, columns: tuple[int, ...], changes: _Changes) -> _Hold | None:
    """How long each value is held, None where nothing shows that it is."""
    n, k, p = changes.events, changes.repeated, min(changes.chance, 0.5)
    if n < _DISTINCT or changes.distinct < _DISTINCT or bdtrc(k - 1, n, p) > FALSE_ALARM:
        return None
    lengths = _lengths(repeats(values, columns))
    typical = float(np.median(lengths))
    # Two holds of one value make one run: such runs tell nothing of the rate
    single = lengths <= max(1.5 * typical, 2.0)
    if k < _HELD * n and not _regular(lengths, single):
        return None
    share = min(k / n, 1.0 - 0.5 / n)
    gain = k * np.log(share / p) + (n - k) * np.log((1.0 - share) / (1.0 - p))
    return _Hold(float(np.mean(lengths[single])), float(gain))


def _lengths(same: Flags) -> Array:
    """Samples of each run of one value, without the cut ones at either end."""
    return np.asarray(np.diff(np.flatnonzero(~same))[1:], float)


def _regular(lengths: Array, single: Flags) -> bool:
    """Whether runs come as a free clock of a lower rate makes them: their sums stay within a sample."""
    usable = lengths[single]
    repeated = float(np.mean(usable)) - 1.0
    if len(usable) < 4 * _RUNS or np.mean(single) < _HELD or repeated < _SELDOM:
        return False
    sums = np.add.reduceat(usable, np.arange(0, len(usable) - _RUNS + 1, _RUNS))[:-1]
    # Repeats at random would make the sums' variance _RUNS times that of one run
    return bool(np.std(sums) <= min(1.0, 0.5 * np.sqrt(_RUNS * repeated * max(1.0 - repeated, 0.25))))


def _first_of_each(same: Flags, samples: float) -> Flags:
    """(n,) the first sample of each hold. A run as long as several holds of one value keeps one for each."""
    kept = ~same
    starts = np.flatnonzero(kept)
    lengths = np.diff(np.append(starts, len(same)))
    # What is half a hold too long is still one
    holds = np.ceil(lengths / np.ceil(samples - 0.1) - 0.5).astype(np.int64)
    for k in np.flatnonzero(holds > 1):
        kept[starts[k] + (np.arange(holds[k]) * lengths[k]) // holds[k]] = True
    return kept


def _fault(session: RawSession, group: list[Spotted]) -> SetupFault:
    names = devices_of(group)
    rate = float(np.median([one.value for one in group]))
    changed = group[0].changed
    removed, left = sum(one.count for one in group), sum(len(one.changed.stamp_ns) for one in group)
    topic_rate = rate * (removed + left) / max(left, 1)
    verb, its = ("repeats", "its") if len(names) == 1 else ("repeat", "their")
    times = (removed + left) / max(left, 1)
    statement = (
        f"{listed(names)} {verb} each sample {times:.3g} times: {its} true rate is {rate:.4g} Hz, "
        f"the topic's {topic_rate:.4g} Hz. Only the first of each is used."
    )
    advice = (
        "Publish a message only when the converter has a new value, or set the converter's rate to "
        f"{topic_rate:.4g} Hz."
    )
    return SetupFault(
        "held_samples", {**where(session, group), "quantity": changed.channel},
        {"rate": {"value": rate, "std": 0.0, "unit": "Hz"}},
        statement, advice, "", True, sum(one.gain for one in group),
    )  # fmt: skip
