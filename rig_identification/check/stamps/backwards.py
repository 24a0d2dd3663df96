"""A recording whose stamps decrease: it was played or written in reverse."""

from __future__ import annotations

import math

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.mended import Mended, groups, mended_streams, names
from rig_identification.check.stamps.streams import Stream, reversed_streams
from rig_identification.check.stamps.told import found, owner, quantity, recordings_text
from rig_identification.raw import RawSession

ORDER = 30

#: Part of the steps that lead back in a stream whose messages are merely out of order: at random, a half.
_AT_RANDOM = 0.5


def find(session: RawSession) -> tuple[Found, ...]:
    """Streams most of whose stamps lie before those of the message before, turned round."""
    by_device = mended_streams(session, _mend)
    result = []
    for devices in groups(by_device):
        some = [one for device in sorted(devices) for one in by_device[device]]
        session = reversed_streams(session, frozenset(one.stream.key for one in some))
        result.append(_told(session, devices, some))
    return tuple(result)


def _mend(stream: Stream) -> Mended | None:
    steps = np.diff(stream.stamps)
    back, on = int(np.count_nonzero(steps < 0)), int(np.count_nonzero(steps > 0))
    if back <= on:
        return None
    part = back / (back + on)
    # Relative entropy of what is seen to steps at random: nats a step.
    entropy = part * math.log(part / _AT_RANDOM)
    if on:
        entropy += (1.0 - part) * math.log((1.0 - part) / (1.0 - _AT_RANDOM))
    return Mended(stream, stream.stamps[::-1], (back + on) * entropy, {"back": back, "steps": len(steps)})


def _told(session: RawSession, devices: frozenset[str], some: list[Mended]) -> Found:
    where = names(some)
    back, steps = (int(sum(one.facts[name] for one in some)) for name in ("back", "steps"))
    return found(
        session, session, devices, "backwards", where,
        parameters={"backward": quantity(back / steps, 0.0, "1")},
        statement=f"{owner(session, devices)} stamps decrease from message to message"
        f"{recordings_text(session, where)}: {back:,} of {steps:,} steps lead back. "
        "The messages were taken in reverse order.",
        advice="Convert the bag with its messages in the order of their stamps, or record it anew.",
        gain=sum(one.gain for one in some),
    )  # fmt: skip
