"""Faults of the host's clock: it stamps every device and what the recorder receives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from bench.first_day.faults.base import Case, Injector, on
from bench.first_day.faults.stamps import LEAP, SECOND, STEPS, Stamps, ahead, stamp_case
from rig_identification.raw import RawChannel, RawSession


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of the one clock that stamps all devices and the recorder's receipts."""
    everything = tuple(sorted({c.device for r in raw.recordings for c in r.channels}))
    for step in STEPS:
        for sign in (1.0, -1.0):
            inject = _host_step(sign * step)
            yield stamp_case("clock_step", "all", f"{sign * step:+g}_s", everything, inject, offset=step)
    inject = on(everything, ahead(LEAP))
    yield stamp_case("leap_seconds", "all", "devices_ahead_of_recorder", everything, inject, offset=LEAP)
    reason = "all clocks alike, the recorder's too, against a time that nothing in the session shows"
    yield stamp_case("leap_seconds", "all", f"{LEAP:+d}_s", everything, _host_shift(LEAP * SECOND), reason)
    reason = "all clocks run alike: 100 ppm of time are 200 ppm of the pendulum's length"
    yield stamp_case("clock_drift", "all", "+100_ppm", everything, _host_drift(100.0), reason)
    yield stamp_case("backwards", "all", "every_recording", everything, _backwards(("static", "dynamic")))
    yield stamp_case("backwards", "all", "runs", everything, _backwards(("dynamic",)))


def _host_step(step: float) -> Injector:
    """The host's clock is set once in every run: stamps and receipts after that instant are shifted."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        recordings = []
        for recording in raw.recordings:
            first = min(int(c.received_ns[0]) for c in recording.channels)
            last = max(int(c.received_ns[-1]) for c in recording.channels)
            at = first + round(rng.uniform(0.3, 0.7) * (last - first))
            shift = round(step * SECOND)
            channels = tuple(
                replace(
                    c,
                    stamp_ns=c.stamp_ns + shift * (c.stamp_ns >= at),
                    received_ns=c.received_ns + shift * (c.received_ns >= at),
                )
                for c in recording.channels
            )
            if recording.kind == "dynamic":
                recording = replace(recording, channels=channels)
            recordings.append(recording)
        return replace(raw, recordings=tuple(recordings))

    return inject


def _all_times(raw: RawSession, law: Callable[[Stamps, int], Stamps]) -> RawSession:
    recordings = []
    for recording in raw.recordings:
        first = min(int(c.stamp_ns[0]) for c in recording.channels)
        channels = tuple(
            replace(c, stamp_ns=law(c.stamp_ns, first), received_ns=law(c.received_ns, first))
            for c in recording.channels
        )
        recordings.append(replace(recording, channels=channels))
    return replace(raw, recordings=tuple(recordings))


def _host_shift(shift: int) -> Injector:
    return lambda raw, rng: _all_times(raw, lambda t, first: t + shift)


def _host_drift(ppm: float) -> Injector:
    return lambda raw, rng: _all_times(
        raw, lambda t, first: t + np.round(ppm * 1e-6 * (t - first)).astype(np.int64)
    )


def _backwards(kinds: tuple[str, ...]) -> Injector:
    """Played or exported from the end: the last message comes first in the file, with the first receipt."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        return replace(channel, stamp_ns=channel.stamp_ns[::-1].copy(), values=channel.values[::-1].copy())

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        everything = {c.device for r in raw.recordings for c in r.channels}
        return on(everything, change, kinds)(raw, rng)

    return inject
