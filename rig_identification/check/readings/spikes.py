"""Single samples far off: one to three in one device only, the signal goes on as before.

What the body does is seen by several devices or rings for more than three samples, and a cable that snaps
does so from slack. Static electricity and damaged bytes do neither.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import bdtrc

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import Array, Flags, channels_of, runs
from rig_identification.check.readings.outliers import OUTLIER, Outliers, outliers
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

ORDER = 50
#: Other devices' outliers beside spikes are taken for chance down to this probability.
_CHANCE = 1e-3
#: Of blows to the body, or a cable's snaps, other devices see this share; the rest fall between their
#: samples.
_BLOWS_SEEN = 0.9
#: Nats for damaged samples against blows: one spike that nothing else sees has ln 10.
_DOUBT = np.log(5.0)
#: Places and angles cannot jump forth and back, whoever knocks.
_KINEMATIC = ("mocap", "exciter_shaft")


@dataclass(frozen=True)
class _Witnessed:
    """The spikes of one channel in one recording, before the other devices that have outliers."""

    seen: Flags  # (k, devices) whether the device has an outlier at the time of the spike
    chance: Array  # (devices,) of that for any time
    witnesses: bool  # whether there are other devices at all


def find(session: RawSession) -> tuple[Found, ...]:
    """Channels with spikes; the samples are left out."""
    seen = {
        (number, channel.topic): outliers(channel, start_ns(session.recordings[number]))
        for _, recorded in channels_of(session)
        for number, channel in recorded
    }
    spotted = []
    for (_, name), recorded in channels_of(session):
        watched = [(number, channel, seen[number, channel.topic]) for number, channel in recorded]
        beside = {
            number: [one for (n, topic), one in seen.items() if n == number and topic != channel.topic]
            for number, channel, _ in watched
        }
        witnessed = [_witnessed(own, beside[number]) for number, _, own in watched]
        if name not in _KINEMATIC and not _damaged(witnessed):
            continue
        for (number, channel, own), one in zip(watched, witnessed, strict=True):
            spike = _unseen(own, one)
            if spike.any():
                spotted.append(_spotted(channel, number, spike, own))
    return told(session, together(spotted), _fault)


def _spotted(channel: RawChannel, number: int, spike: Flags, seen: Outliers) -> Spotted:
    gain = float(np.sum(0.5 * np.minimum(seen.off[spike], 1e3) ** 2 - np.log(len(spike))))
    return Spotted(
        channel.device, channel.channel, number, without(channel, spike), spans_of(spike, seen.time),
        len(runs(spike)[0]), gain, float(np.count_nonzero(spike)),
    )  # fmt: skip


def _witnessed(own: Outliers, others: list[Outliers]) -> _Witnessed:
    """Which spikes of a channel other devices see as well."""
    starts, ends = runs(own.spike)
    middle = 0.5 * (own.time[starts] + own.time[ends - 1])
    length = max(float(np.ptp(own.time)), 1e-9)
    seen, chance = [], []
    for other in others:
        events = np.sort(other.time[other.off > OUTLIER])
        if not len(events):
            continue
        reach = own.reach + other.reach
        behind = np.searchsorted(events, middle)
        before, after = events[np.maximum(behind - 1, 0)], events[np.minimum(behind, len(events) - 1)]
        seen.append(np.minimum(np.abs(middle - before), np.abs(middle - after)) <= reach)
        covered = float(np.sum(np.minimum(np.diff(events), 2.0 * reach))) + 2.0 * reach
        chance.append(min(covered / length, 1.0 - 1e-9))
    return _Witnessed(
        np.array(seen, bool).reshape(len(seen), len(starts)).T, np.array(chance, float), bool(others)
    )


def _damaged(witnessed: list[_Witnessed]) -> bool:
    """Whether others see no more of the spikes than by chance; of the body's blows they see nearly all.

    Each device sees a damaged sample by its own chance. A blow, in nine cases of ten, one of them sees for
    certain, whichever it is, and the others by chance: that makes what is seen likelier by the mean of
    seen / chance over the devices. So chance meetings of many devices with spikes do not add up to a blow.
    """
    gain = 0.0
    for one in witnessed:
        if one.witnesses:
            told = (one.seen / one.chance).sum(axis=1) / max(len(one.chance), 1)
            gain -= float(np.sum(np.log(1.0 - _BLOWS_SEEN + _BLOWS_SEEN * told)))
    return bool(gain > _DOUBT)


def _unseen(own: Outliers, one: _Witnessed) -> Flags:
    """(n,) the spikes without those that others see, where these are more than chance makes them."""
    spike = np.array(own.spike)
    seen: Flags = np.any(one.seen, axis=1)
    by_any = 1.0 - float(np.prod(1.0 - one.chance))
    if bdtrc(np.count_nonzero(seen) - 1, len(seen), by_any) <= _CHANCE:
        for a, b in [pair for pair, known in zip(zip(*runs(spike), strict=True), seen, strict=True) if known]:
            spike[a:b] = False
    return np.asarray(spike)


def _fault(session: RawSession, group: list[Spotted]) -> SetupFault:
    names, count = devices_of(group), sum(one.count for one in group)
    samples = int(sum(one.value for one in group))
    verb = "has" if len(names) == 1 else "have"
    noun = "spike" if count == 1 else "spikes"
    what = f"{count} {noun} of one to three samples" if samples != count else f"{count} {noun} of one sample"
    return SetupFault(
        "spikes", where(session, group), {"count": {"value": count, "std": 0.0, "unit": "1"}},
        f"{listed(names)} {verb} {what} in {of_recordings(session, group)} that no other device sees. "
        f"{samples} samples are left out.",
        "Look at shield, ground and plugs of the device's cable, and let the driver check what it receives.",
        "", True, sum(one.gain for one in group),
    )  # fmt: skip
