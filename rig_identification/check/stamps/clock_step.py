"""Steps of a clock during a recording: the host's, by which all devices jump at once, or one device's."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.stamps.common_clock import placement
from rig_identification.check.stamps.step_evidence import (
    Jump,
    by_ends,
    by_order,
    by_receipt,
    by_values,
    lasting_jumps,
)
from rig_identification.check.stamps.streams import GROUND_TRUTH, SECOND, Stream, streams, with_stamps
from rig_identification.check.stamps.told import (
    PRICE,
    devices_of,
    found,
    owner,
    quantity,
)
from rig_identification.raw import RawSession, Stamps

ORDER = 60

#: A clock that steps more often than this in a recording is none.
_MOST = 10


@dataclass(frozen=True)
class _Step:
    """One step, in every stream that has it."""

    place: int
    jumps: tuple[Jump, ...]
    size: float  # s
    gain: float  # nats
    everyone: bool  # all devices of the recording have it

    @property
    def devices(self) -> frozenset[str]:
        return frozenset(jump.stream.device for jump in self.jumps)


def find(session: RawSession) -> tuple[Found, ...]:
    """Steps of clocks, undone: what follows them is put on the clock of what precedes, or the reverse."""
    steps: list[_Step] = []
    for place in range(len(session.recordings)):
        for _ in range(_MOST):
            step = _step(list(streams(session, place)))
            if step is None:
                break
            steps.append(step)
            session = with_stamps(session, _undone(step, list(streams(session, place))))
    every = devices_of(session)
    by_devices: dict[frozenset[str], list[_Step]] = {}
    for step in steps:
        key = every if step.everyone else step.devices - {GROUND_TRUTH}
        by_devices.setdefault(key, []).append(step)
    return tuple(_told(session, devices, some) for devices, some in by_devices.items() if devices)


def _step(here: list[Stream]) -> _Step | None:
    """The step that explains most of one recording."""
    candidates = [jump for stream in here for jump in lasting_jumps(stream)]
    candidates = [jump for jump in candidates if jump.stream.device != GROUND_TRUTH] or candidates
    best: _Step | None = None
    seen: set[tuple[tuple[int, str], int]] = set()
    for jump in sorted(candidates, key=lambda j: (j.interval, j.stream.key, j.after)):
        if (jump.stream.key, jump.after) not in seen:
            step = _with_others(jump, here, len(candidates))
            seen |= {(j.stream.key, j.after) for j in step.jumps}
            if step.gain > PRICE and (best is None or step.gain > best.gain):
                best = step
    return best


def _with_others(jump: Jump, here: list[Stream], tried: int) -> _Step:
    """A jump with the like ones of other streams at the same time, and what tells that it is a step."""
    jumps, size = [jump], jump.size
    still: list[Stream] = []
    for stream in here:
        if stream.key != jump.stream.key:
            other = _like(jump, stream)
            if other is None:
                still.append(stream)
            else:
                jumps.append(other)
    fast = [j for j in jumps if j.interval <= 1.5 * jump.interval]
    size = float(np.median([_size(j) for j in fast]))
    if size * jump.size < 0.5 * jump.size**2:
        return _Step(jump.stream.place, tuple(jumps), size, 0.0, False)  # samples about it tell of none
    gain = sum(by_order(j) + by_receipt(j) for j in jumps) - math.log(tried)
    if size > 5.0 * jump.interval:
        gain += by_values(jumps, size)
    still = [s for s in still if s.device != GROUND_TRUTH]
    if still:
        gain += sum(by_ends(j, still) for j in jumps) / len(jumps)
    return _Step(jump.stream.place, tuple(jumps), size, gain, not still)


def _like(jump: Jump, stream: Stream) -> Jump | None:
    """The jump of another stream at the time of this one; None where its stamps go on evenly there."""
    last = int(jump.stream.stamps[jump.after - 1])
    times = (stream.stamps - last) / SECOND
    steps = np.diff(times)
    interval = float(np.median(steps[steps > 0.0])) if np.any(steps > 0.0) else 0.0
    reach = 2.0 * (interval + jump.interval)
    near = np.flatnonzero(np.abs(times[:-1]) <= reach)
    if interval <= 0.0 or not len(near):
        return None
    best = int(near[np.argmin(np.abs(steps[near] - interval - jump.size))])
    size = float(steps[best]) - interval
    if abs(size - jump.size) >= abs(size) or abs(size - jump.size) > 0.5 * abs(jump.size) + 2.0 * interval:
        return None
    return Jump(stream, best + 1, interval, size)


def _size(jump: Jump) -> float:
    """s, from ten pairs of samples about the jump, as jitter and single losses leave it."""
    stamps, after = jump.stream.stamps, jump.after
    count = min(10, after, len(stamps) - after)
    pairs = np.arange(count)
    spans = (stamps[after + pairs] - stamps[after - 1 - pairs]) / SECOND
    return float(np.median(spans - jump.interval * (2 * pairs + 1)))


def _undone(step: _Step, here: list[Stream]) -> dict[tuple[int, str], Stamps]:
    """Stamps of the streams with the step taken out, on the side that lies with the other devices."""
    shift = round(step.size * SECOND)
    keys = {jump.stream.key for jump in step.jumps}
    others = [s for s in here if s.key not in keys and s.device != GROUND_TRUTH]
    result = {}
    for jump in step.jumps:
        stamps = jump.stream.stamps.copy()
        stamps[jump.after :] -= shift
        placed = placement(jump.stream.with_stamps(stamps), others, jump.stream)
        # Before the step the clock was wrong where the whole, put on it, lies off by the step.
        if placed is not None and abs(placed.offset + step.size) < abs(placed.offset):
            stamps += shift
        result[jump.stream.key] = stamps
    return result


def _told(session: RawSession, devices: frozenset[str], some: list[_Step]) -> Found:
    where = [session.recordings[step.place].name for step in some]
    times, texts = [], []
    for step in some:
        first = min(int(s.stamps.min()) for s in streams(session, step.place))
        lead = step.jumps[0]
        at = (int(lead.stream.stamps[lead.after - 1]) - first) / SECOND
        name = session.recordings[step.place].name
        times.append({"recording": name, "start": round(at, 6), "end": round(at, 6)})
        texts.append(
            f"{abs(step.size):.4g} s {'forwards' if step.size > 0 else 'backwards'} at {at:.2f} s of {name}"
        )
    largest = max(some, key=lambda step: abs(step.size))
    subject = owner(session, devices)
    clock = (
        "The host's clock stepped under all devices"
        if subject.startswith("All")
        else f"{subject} clock stepped"
    )
    return found(
        session, session, devices, "clock_step", where,
        parameters={"offset": quantity(largest.size, 0.1 * largest.jumps[0].interval, "s")},
        statement=f"{clock}: {', '.join(texts)}.",
        advice="Let the clock be set before recording starts and slewed, not stepped, while it runs (chrony, "
        "or PTP with a limit on steps).",
        gain=sum(step.gain for step in some), times=times,
    )  # fmt: skip
