"""Messages whose numbers no device measures: bytes that were damaged on their way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.raw import RawChannel, RawSession

Array = NDArray[np.float64]

#: No channel measures this in SI units, nor in an amplifier's counts.
ABSURD = 1e12


def without_damaged(values: Array) -> Array:
    """(n, width) values; rows that hold a number of at least ``ABSURD``, or an infinite one, are NaN.

    What is NaN was not measured. A number that cannot be tells that its message is damaged.
    """
    damaged = np.any(np.abs(values) >= ABSURD, axis=1)
    return np.where(damaged[:, None], np.nan, values) if damaged.any() else values


def session_without_damaged(session: RawSession) -> RawSession:
    """The session with :func:`without_damaged` values: nothing that computes with them overflows."""
    recordings = tuple(
        replace(recording, channels=tuple(map(_channel, recording.channels)))
        for recording in session.recordings
    )
    return replace(session, recordings=recordings)


def _channel(channel: RawChannel) -> RawChannel:
    values = without_damaged(channel.values)
    return channel if values is channel.values else replace(channel, values=values)
