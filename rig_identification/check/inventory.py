"""What the bags hold: one account a topic, and whether the fit uses it.

Rates and gaps are those of the stamps as recorded. Whether a topic is used is asked of the session as the
examiners left it: a clock that they corrected runs with the others again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rig_identification.cleaning.channel import IN_PART
from rig_identification.examination import TopicAccount
from rig_identification.raw import RawChannel, RawRecording, RawSession, Stamps
from rig_identification.rig import Rig

#: Intervals longer than this many median ones are gaps, as in the account of data quality.
_GAP = 1.5
#: Share of the stamps at either end that says nothing of when a device ran: single damaged stamps lie there.
_STRAY = 0.01
#: Devices whose readings mean nothing without a place or an orientation in the description.
MOUNTED = ("imu", "inclinometer", "exciter")


@dataclass(frozen=True)
class Span:
    """When a channel ran, by its own stamps."""

    first: float  # ns
    last: float

    @property
    def middle(self) -> float:
        """ns."""
        return 0.5 * (self.first + self.last)

    def meets(self, other: Span) -> bool:
        """Whether the two ran at one time."""
        return self.first <= other.last and other.first <= self.last


def inventory(raw: RawSession, used: RawSession) -> tuple[TopicAccount, ...]:
    """Account of every topic of every bag.

    raw: the session as recorded; used: the same with the faults that were found undone, without the channels
    that the examination left out.
    """
    left = {recording.name: recording for recording in used.recordings}
    return tuple(
        account
        for recording in raw.recordings
        for account in _recording_accounts(
            recording, left.get(recording.name, replace(recording, channels=())), raw.rig
        )
    )


def offsets(recording: RawRecording) -> dict[str, float]:
    """Seconds by which the stamps of each topic lie off the others', for topics that share no time with them.

    The others are the largest set of channels that ran at the same time as one of them, and the one with most
    messages where two sets are as large.
    """
    spans = {channel.topic: span_of(channel.stamp_ns) for channel in recording.channels}
    known = {topic: span for topic, span in spans.items() if span is not None}
    if not known:
        return {}
    counts = {channel.topic: len(channel.stamp_ns) for channel in recording.channels}
    middle = known[
        max(known, key=lambda topic: (sum(known[topic].meets(s) for s in known.values()), counts[topic]))
    ]
    return {
        topic: (span.middle - middle.middle) / 1e9 for topic, span in known.items() if not span.meets(middle)
    }


def span_of(stamp_ns: Stamps) -> Span | None:
    """When a channel ran, single damaged stamps aside; None where no stamp is above zero."""
    stamps = stamp_ns[stamp_ns > 0]
    if not len(stamps):
        return None
    first, last = np.quantile(stamps.astype(np.float64), [_STRAY, 1.0 - _STRAY])
    return Span(float(first), float(last))


def _recording_accounts(raw: RawRecording, used: RawRecording, rig: Rig) -> list[TopicAccount]:
    start_ns = _start(raw)
    kept, apart = {channel.topic for channel in used.channels}, offsets(used)
    accounts = []
    for channel in raw.channels:
        reason = _unused(channel, rig, kept, apart)
        accounts.append(_account(raw.name, channel, start_ns, reason))
    known = {channel.topic for channel in raw.channels}
    accounts += [
        TopicAccount(
            raw.name, name, kind, None, False, raw.counts.get(name, 0), 0.0, 0.0, 0.0, 0, 0.0, None,
            "no topic of the contract" if raw.counts.get(name, 0) else "has no message",
        )
        for name, kind in raw.listed.items()
        if name not in known
    ]  # fmt: skip
    return accounts


def _start(recording: RawRecording) -> int:
    """First stamp of the topics that ran together, ns."""
    apart = offsets(recording)
    together = [c.stamp_ns[c.stamp_ns > 0] for c in recording.channels if c.topic not in apart]
    return min((int(stamps.min()) for stamps in together if len(stamps)), default=0)


def _unused(channel: RawChannel, rig: Rig, kept: set[str], apart: dict[str, float]) -> str:
    """Why the fit does not use a channel; "" where it does."""
    if channel.channel == "ground_truth":
        return "a simulation's truth, never an input"
    if channel.topic not in kept:
        return "left out: a fault of the set-up says why"
    if channel.device in MOUNTED and getattr(rig, channel.device) is None:
        return f"the rig description has no {channel.device}"
    if channel.topic in apart:
        return f"{shift_text(apart[channel.topic])}: they share no time"
    known = np.isfinite(channel.values)
    if not (known if channel.channel in IN_PART else known.all(axis=1)).any():
        return "never a number in every field: taken as not measured"
    return ""


def shift_text(seconds: float) -> str:
    """A clock that is off, as a person says it."""
    amount = abs(seconds)
    text = f"{amount:.1f} s" if amount < 3600.0 else f"{amount / 3600.0:.1f} h" if amount < 86400.0 else ""
    text = text or f"{amount / 86400.0:.0f} days"
    return f"stamps lie {text} {'after' if seconds > 0.0 else 'before'} the other topics'"


def _account(recording: str, channel: RawChannel, start_ns: int, reason: str) -> TopicAccount:
    stamps = np.sort(channel.stamp_ns[channel.stamp_ns > 0])
    steps = np.diff(stamps) / 1e9
    median = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    gaps = steps[steps > _GAP * median] if median else steps[:0]
    first, last = (float((stamps[i] - start_ns) / 1e9) for i in (0, -1)) if len(stamps) else (0.0, 0.0)
    return TopicAccount(
        recording=recording, topic=channel.topic, message_type=channel.message_type, device=channel.device,
        used=not reason, count=len(channel.stamp_ns), rate=1.0 / median if median else 0.0,
        start=first, end=last, gaps=len(gaps), longest_gap=float(gaps.max()) if len(gaps) else 0.0,
        clock=_clock(channel), note=reason,
    )  # fmt: skip


def _clock(channel: RawChannel) -> float | None:
    """Median receive time less stamp, s; None where receive times do not run along with the stamps.

    A converter may have written one time for all messages, or the stamps themselves.
    """
    valid = channel.stamp_ns > 0
    stamps, received = channel.stamp_ns[valid], channel.received_ns[valid]
    span = span_of(stamps)
    if span is None or len(stamps) < 2 or np.array_equal(stamps, received):
        return None
    if float(np.ptp(received)) < 0.5 * (span.last - span.first) or not np.ptp(received):
        return None
    return float(np.median(received - stamps) / 1e9)
