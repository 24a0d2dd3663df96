"""The same numbers twice: two cables on one channel, or one bag filed under two names.

No noise repeats itself: channels that agree to the last bit are copies. Of two cables on one channel the
readings at rest tell which cable the channel belongs to.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from rig_identification.check.consistency.hypothesis import Change, fault
from rig_identification.check.consistency.judge import TIE
from rig_identification.check.consistency.reduced import reduced
from rig_identification.check.consistency.rest import fit_rest
from rig_identification.check.found import Found
from rig_identification.raw import RawChannel, RawRecording, RawSession

#: Samples, and different values among them, that make a chance agreement impossible.
SAMPLES, VALUES = 20, 8
#: Correlation of two channels' noise beyond chance at any length, and that of a copy taken at other instants.
SHARED = 0.5
ORDER = 0
#: Nats by which so many samples of noise that agree speak for a copy: each brings -log(1 - r^2) / 2.
COPIED = float(-0.5 * SAMPLES * np.log(1.0 - 0.99**2))


def find(session: RawSession) -> tuple[Found, ...]:
    """Copies of recordings, then copies of cells."""
    out: list[Found] = []
    for found in _recordings(session):
        session = found.session
        out.append(found)
    found_cells = _cells(session)
    return (*out, *found_cells)


def alike(one: RawChannel, other: RawChannel) -> bool:
    """Whether two channels hold the same numbers, to the last bit or taken at other instants.

    Bends between neighbours (second differences) are mostly noise, which two converters do not share.
    """
    n = min(len(one.values), len(other.values))
    if n < SAMPLES or len(np.unique(one.values[np.isfinite(one.values)])) < VALUES:
        return False
    if len(one.values) == len(other.values) and np.array_equal(one.values, other.values, equal_nan=True):
        return True
    return _shared_noise(one, other) if one.channel == "tension" else False


def _shared_noise(one: RawChannel, other: RawChannel) -> bool:
    order = np.argsort(other.stamp_ns, kind="stable")
    stamp = other.stamp_ns[order].astype(float)
    both = (one.stamp_ns >= stamp[0]) & (one.stamp_ns <= stamp[-1])
    if np.count_nonzero(both) < SAMPLES:
        return False
    a = one.values[both, 0]
    b = np.interp(one.stamp_ns[both].astype(float), stamp, other.values[order, 0])
    noise = float(np.median(np.abs(np.diff(a, n=2))))
    if not noise > 0.0 or float(np.median(np.abs(a - b))) > noise:
        return False
    return float(np.corrcoef(np.diff(a, n=2), np.diff(b, n=2))[0, 1]) > SHARED


def _recordings(session: RawSession) -> Iterator[Found]:
    for one, other in combinations(session.recordings, 2):
        if other not in session.recordings or not _same(one, other):
            continue
        drop = one if one.holdout and not other.holdout else other
        kept = other if drop is one else one
        session = Change(dropped=(drop.name,)).raw(session)
        told = fault(
            "wiring",
            {"channel": "session", "kind": "same_recording", "recordings": [one.name, other.name]},
            {},
            f"{one.name} and {other.name} are the same recording.",
            f"Give each run its own bag in session.yaml. {drop.name} is left out: {kept.name} cannot be "
            "fitted twice" + (", nor held out from itself." if one.holdout != other.holdout else "."),
        )
        yield Found(replace(told, gain=COPIED), session)


def _same(one: RawRecording, other: RawRecording) -> bool:
    pairs = [(c, other.channel(c.device, c.channel)) for c in one.channels if c.channel != "ground_truth"]
    known = [(a, b) for a, b in pairs if b is not None and len(a.values) >= SAMPLES]
    told = [alike(a, b) for a, b in known if len(np.unique(a.values[np.isfinite(a.values)])) >= VALUES]
    return bool(told) and all(told)


def _cells(session: RawSession) -> tuple[Found, ...]:
    names = [c.name for c in session.rig.cables]
    groups: list[set[str]] = []
    for one, other in combinations(names, 2):
        if _copies(session, one, other):
            group = next((g for g in groups if one in g or other in g), None)
            if group is None:
                groups.append({one, other})
            else:
                group |= {one, other}
    out = []
    for group in groups:
        found = _one_channel(session, sorted(group, key=names.index), names)
        session = found.session
        out.append(found)
    return tuple(out)


def _copies(session: RawSession, one: str, other: str) -> bool:
    pairs = [(r.channel(one), r.channel(other)) for r in session.recordings]
    known = [(a, b) for a, b in pairs if a is not None and b is not None]
    return bool(known) and all(alike(a, b) for a, b in known)


def _one_channel(session: RawSession, group: list[str], names: list[str]) -> Found:
    """Leave out the cells whose readings are another one's; which one it is rest tells where it can."""
    if len(group) == len(names) or len(group) > 2:
        return _told(
            session, group, tuple(group), f"{', '.join(group)} read the same channel or the sum of all"
        )
    costs = {}
    for kept in group:
        out = tuple(name for name in group if name != kept)
        small = reduced(Change(left_out=out).raw(session))
        rest = fit_rest(small.rig, small.at_rest)
        costs[kept] = 0.5 * rest.square if rest is not None else np.inf
    kept, lost = sorted(group, key=lambda name: costs[name])
    if costs[lost] - costs[kept] > TIE:
        return _told(
            session, group, (lost,), f"{' and '.join(group)} read the same channel, the cell of {kept}"
        )
    return _told(
        session, group, tuple(group), f"{' and '.join(group)} read the same channel; rest does not tell whose"
    )


def _told(session: RawSession, group: list[str], left_out: tuple[str, ...], what: str) -> Found:
    told = fault(
        "wiring",
        {"channel": group, "kind": "one_channel"},
        {},
        f"{what[0].upper()}{what[1:]}: their numbers agree to the last bit.",
        f"Wire each cell to a channel of its own. Until then {', '.join(left_out)} "
        f"{'is' if len(left_out) == 1 else 'are'} left out.",
        corrected=False,
    )
    return Found(replace(told, gain=COPIED), Change(left_out=left_out).raw(session))
