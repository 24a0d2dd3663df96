"""Gaps filled with zeros: all components are exactly 0 while the samples on both sides are far from it.

A slack cable and an exciter that stops come to 0 by and by: their last samples before it move as far as the
last step. What is filled falls to 0, and comes back, in a step that no sample beside it makes.
"""

from __future__ import annotations

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import (
    NOISY,
    Array,
    Flags,
    channels_of,
    groups,
    noise_std,
    resolution,
    runs,
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
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawSession

ORDER = 12
#: Samples on either side whose steps are compared with the step to 0.
_BESIDE = 10
#: The largest of nine steps of white noise is about 2.4 std: five of them are twelve std.
_FAR = 5.0
#: Largest of nine steps of white noise in std.
_LARGEST = 2.4
#: Devices that a person switches: at rest they may read exactly 0 without any fault, unless they have noise.
_SWITCHED = ("exciter_force", "exciter_shaft")


def find(session: RawSession) -> tuple[Found, ...]:
    """Channels with filled gaps; the filled samples are left out."""
    spotted = []
    for (_, _), recorded in channels_of(session):
        for number, channel in recorded:
            one = _spotted(channel, number, start_ns(session.recordings[number]))
            spotted += [one] if one is not None else []
    return told(session, together(spotted), _fault)


def _spotted(channel: RawChannel, number: int, begun: int) -> Spotted | None:
    columns = [k for kept in groups(channel).values() for k in kept]
    if not columns:
        return None
    values = channel.values[:, columns]
    zero = np.all(values == 0.0, axis=1)
    if not zero.any() or zero.all():
        return None
    noisy = any(noise_std(column) >= NOISY * resolution(column) > 0.0 for column in values.T)
    if channel.channel in _SWITCHED and not noisy:
        return None
    filled, gain = _filled(values, zero, at_ends=noisy)
    if not filled.any():
        return None
    return Spotted(
        channel.device, channel.channel, number, without(channel, filled),
        spans_of(filled, seconds(channel, begun)), int(np.count_nonzero(filled)), gain,
    )  # fmt: skip


def _filled(values: Array, zero: Flags, *, at_ends: bool) -> tuple[Flags, float]:
    """(n,) which of the ``zero`` samples are filled, and the nats for it.

    at_ends: whether zeros before the first reading or after the last one count, which one step has to tell.
    """
    measured = np.flatnonzero(~zero & np.isfinite(values).all(axis=1))
    filled, gain = np.zeros(len(values), bool), 0.0
    for a, b in zip(*runs(zero), strict=True):
        place = int(np.searchsorted(measured, a))
        before = values[measured[max(place - _BESIDE, 0) : place]][::-1]
        after = values[measured[place : place + _BESIDE]]
        sides = [_distance(side) for side in (before, after) if len(side) > 2]
        if len(sides) < (1 if at_ends and (a == 0 or b == len(values)) else 2):
            continue
        # One component must be far from 0 on every side that there is
        distance = float(np.max(np.min(sides, axis=0)))
        if distance > _FAR:
            filled[a:b] = True
            gain += 0.5 * (_LARGEST * distance) ** 2
    return filled, gain


def _distance(side: Array) -> Array:
    """(width,) how far the sample next to the zeros is from 0, in the largest steps of those beyond it."""
    largest = np.max(np.abs(np.diff(side, axis=0)), axis=0)
    return np.asarray(np.abs(side[0]) / np.maximum(largest, 1e-9 * np.maximum(np.abs(side[0]), 1e-300)))


def _fault(session: RawSession, group: list[Spotted]) -> SetupFault:
    names, count = devices_of(group), sum(one.count for one in group)
    verb = "reads" if len(names) == 1 else "read"
    return SetupFault(
        "zero_filled", where(session, group), {"count": {"value": count, "std": 0.0, "unit": "1"}},
        f"{listed(names)} {verb} exactly 0 in {count} samples of {of_recordings(session, group)} between "
        "values far from 0: gaps were filled. These samples are left out.",
        "Let the driver leave a message out, or write NaN, where it has no new reading.",
        "", True, sum(one.gain for one in group),
    )  # fmt: skip
