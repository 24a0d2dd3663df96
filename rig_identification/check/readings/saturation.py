"""Readings at the end of a sensor's range.

Cleaning leaves such samples out, and those within reach of the limit (``cleaning/clipping.py``); here they
are told. The samples stay, so that cleaning sees the limit. A recording that lies at a limit all along does
not show it by itself: it is left out here, where another recording shows the limit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import channels_of, seconds
from rig_identification.check.readings.telling import start_ns, without
from rig_identification.cleaning.channel import clean_channel
from rig_identification.errors import InputError
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawSession
from rig_identification.recording import Overrange

ORDER = 40
#: A single sample that noise of the limit's run makes has one nat at least.
_NATS = 1.0


def find(session: RawSession) -> tuple[Found, ...]:
    """Components that are stuck at an end of range in any recording, one fault for each."""
    seen: dict[tuple[str, str, str | None], list[tuple[str, Overrange]]] = {}
    for (_, _), recorded in channels_of(session):
        here: list[tuple[str, Overrange]] = []
        for number, channel in recorded:
            recording = session.recordings[number]
            here += [(recording.name, end) for end in _ends(channel, recording.where, start_ns(recording))]
        for number, channel in recorded:
            at_end = _throughout(channel, [end for _, end in here], start_ns(session.recordings[number]))
            if at_end is not None:
                everything = np.ones(len(channel.values), bool)
                changed = session.recordings[number].with_channels(without(channel, everything))
                recordings = list(session.recordings)
                recordings[number] = changed
                session = replace(session, recordings=tuple(recordings))
                here.append((changed.name, at_end))
        for name, end in here:
            seen.setdefault((end.device, end.quantity, end.axis), []).append((name, end))
    return tuple(Found(_fault(ends), session) for ends in seen.values())


def _ends(channel: RawChannel, where: str, begun: int) -> tuple[Overrange, ...]:
    try:
        return clean_channel(channel, where).quality(begun).overranges
    except InputError:  # no usable stamp: cleaning says so
        return ()


def _throughout(channel: RawChannel, ends: list[Overrange], begun: int) -> Overrange | None:
    """The limit at which a load cell lies in a whole recording, if another recording shows that limit."""
    values = channel.values[np.isfinite(channel.values)]
    if channel.channel != "tension" or not len(values) or np.ptp(values):
        return None
    for end in ends:
        if end.limit == values[0]:
            times = seconds(channel, begun)
            return replace(end, samples=len(values), start=float(times[0]), end=float(times[-1]))
    return None


def _fault(ends: list[tuple[str, Overrange]]) -> SetupFault:
    first = ends[0][1]
    limits = sorted({end.limit for _, end in ends})
    limit = min(limits, key=abs)
    times = [
        {"recording": name, "start": round(end.start, 3), "end": round(end.end, 3)} for name, end in ends
    ]
    where: dict[str, object] = {
        "channel": first.device, "axis": first.axis, "quantity": first.quantity,
        "recordings": list(dict.fromkeys(name for name, _ in ends)), "times": times,
    }  # fmt: skip
    what = first.quantity.replace("_", " ") + (f" along {first.axis}" if first.axis else "")
    stops = " and ".join(f"{value:.6g}" for value in limits)
    count = sum(end.samples for _, end in ends)
    return SetupFault(
        "saturation", where, {"limit": {"value": limit, "std": 0.0, "unit": first.unit}},
        f"{first.device} stops at the end of its range: {count} samples of {what} lie exactly at {stops} "
        f"{first.unit}. All that noise may have brought there is left out of the fit.",
        "Set a larger range, a lower gain of the amplifier, or shake more gently.",
        "", True, _NATS * count,
    )  # fmt: skip
