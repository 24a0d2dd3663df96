"""Counts that wrap around: a reading that passes one end of the converter's span comes back at the other.

All values lie within one span, and across every jump the signal goes on smoothly once the span is added, so
that the span is the reach of all values. A signal that jumps between two levels, and damaged values, fail
this: noise carries them beyond both levels, and with the reach for a span every jump leaves a step that no
noise makes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import (
    FALSE_ALARM,
    Array,
    channels_of,
    resolution,
    seconds,
)
from rig_identification.check.readings.telling import (
    Spotted,
    devices_of,
    listed,
    of_recordings,
    start_ns,
    together,
    told,
    where,
)
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawSession
from rig_identification.rig import Rig

ORDER = 15
#: Converters: two's complement and unsigned readings of these widths, in steps.
_SPANS = (2.0**16, 2.0**24)
#: Channels of converters with a span. Angles and quaternions that come round are no fault.
_CONVERTERS = ("tension", "exciter_force", "imu", "inclination")
#: A jump is this many times the step that one ordinary sample in a hundred exceeds. Noise has such a step at
#: 2.6 std of its steps: ten std are never reached.
_CLEAR = 4.0
#: Mean of the steps at jumps once the span is added, in such steps. A signal that crosses an end of the
#: span makes steps like all others, of noise 0.7 at most; one that jumps between two levels with noise of
#: four std leaves 1.1 at one level and 2.2 at both.
_SMOOTH = 0.85
#: Distinct values that a converter of a signal that wraps shows; a coarse signal at rest has fewer.
_DISTINCT = 16
#: The mean of so many steps is known to 0.1. Fewer count where the signal stays beyond the end for longer
#: than damaged values last; one alone counts if it is a converter's span.
_JUMPS, _DAMAGED = 8, 3
#: One span in several recordings of a device, and in several cells of one logger.
_SAME = 0.02
_UNITS = {
    "tension": "N", "exciter_force": "N", "inclination": "rad",
    "imu": ("rad/s", "rad/s", "rad/s", "m/s^2", "m/s^2", "m/s^2"),
}  # fmt: skip


@dataclass(frozen=True)
class _Wrap:
    span: float
    jumps: int
    gain: float  # nats


def find(session: RawSession) -> tuple[Found, ...]:
    """Channels that wrap; their spans are added where they are missing."""
    spotted: list[tuple[int, list[Spotted]]] = []
    for (_, _), recorded in channels_of(session):
        if recorded[0][1].channel in _CONVERTERS:
            for column in range(recorded[0][1].values.shape[1]):
                out = _spotted(session, recorded, column)
                recorded = _replaced(recorded, out)
                spotted += [(column, out)] if out else []
    found: list[Found] = []
    for column in sorted({column for column, _ in spotted}):
        alike = together([one for k, out in spotted if k == column for one in out], tolerance=_SAME)
        found += told(session, alike, partial(_fault, column=column))
        session = found[-1].session
    return tuple(found)


def _replaced(recorded: list[tuple[int, RawChannel]], out: list[Spotted]) -> list[tuple[int, RawChannel]]:
    changed = {one.recording: one.changed for one in out}
    return [(number, changed.get(number, channel)) for number, channel in recorded]


def _spotted(session: RawSession, recorded: list[tuple[int, RawChannel]], column: int) -> list[Spotted]:
    wrap = _wrap([channel.values[:, column] for _, channel in recorded])
    if wrap is None:
        return []
    straight = _on_one_branch(session.rig, recorded, column, wrap.span)
    out = []
    for number, channel in recorded:
        changed = np.array(channel.values)
        changed[:, column] = straight[number]
        moved = np.abs(changed[:, column] - channel.values[:, column]) > 0.5 * wrap.span
        if moved.any():
            times = seconds(channel, start_ns(session.recordings[number]))
            out.append(
                Spotted(
                    channel.device, channel.channel, number, replace(channel, values=changed),
                    ((float(times[moved][0]), float(times[moved][-1])),), int(np.count_nonzero(moved)),
                    wrap.gain / len(recorded), wrap.span,
                )
            )  # fmt: skip
    return out


def _wrap(columns: list[Array]) -> _Wrap | None:
    """The span by which all recordings of a column wrap, None where they do not."""
    finite = [column[np.isfinite(column)] for column in columns]
    x = np.concatenate([np.append(column, np.nan) for column in finite])
    steps = np.abs(np.diff(x))
    steps = steps[np.isfinite(steps)]
    if not len(steps):
        return None
    reach = float(np.nanmax(x) - np.nanmin(x))
    jump = steps > 0.5 * reach
    count = int(np.count_nonzero(jump))
    if not count or count == len(steps) or len(np.unique(x[np.isfinite(x)])) < _DISTINCT:
        return None
    typical = float(np.percentile(steps[~jump], 99.0))
    step = resolution(x)
    exact = next((n * step for n in _SPANS if 0.0 <= n * step - reach <= typical), None)
    span = exact or reach + step
    few = count < 2 or (count < _JUMPS and int(np.min(np.diff(np.flatnonzero(jump)))) <= _DAMAGED)
    if span < _CLEAR * typical or (exact is None and few):
        return None
    if float(np.mean(np.abs(span - steps[jump]))) > _SMOOTH * typical:
        return None
    gain = count * float(np.log(span / typical))
    return _Wrap(span, count, gain) if gain > -np.log(FALSE_ALARM) else None


def _on_one_branch(
    rig: Rig, recorded: list[tuple[int, RawChannel]], column: int, span: float
) -> dict[int, Array]:
    """Each recording's column, unwrapped, and all of them by one multiple of the span."""
    straight = {number: _unwrapped(channel.values[:, column], span) for number, channel in recorded}
    # Rest and motion of one device lie around one level
    longest = max(straight, key=lambda number: len(straight[number]))
    level = float(np.nanmedian(straight[longest]))
    for number, one in straight.items():
        straight[number] = one + span * np.round((level - np.nanmedian(one)) / span)
    shift = _branch(rig, recorded, column, straight, span)
    return {number: one + shift for number, one in straight.items()}


def _unwrapped(column: Array, span: float) -> Array:
    out = np.array(column)
    finite = np.isfinite(column)
    out[finite] = np.unwrap(column[finite], period=span)
    # np.unwrap rounds: what is not moved by a span stays as it was, to the bit
    return np.asarray(column + span * np.round((out - column) / span))


def _branch(
    rig: Rig, recorded: list[tuple[int, RawChannel]], column: int, straight: dict[int, Array], span: float
) -> float:
    """The multiple of the span to add, at which most samples are as read, and cables pull."""
    read = np.concatenate([channel.values[:, column] for _, channel in recorded])
    here = np.concatenate([straight[number] for number, _ in recorded])
    level = float(np.nanmedian(here))
    moved = np.round((read - here)[np.isfinite(read)] / span)
    branches, counts = np.unique(moved, return_counts=True)
    likely = branches[counts >= 0.5 * counts.max()]
    expected = 0.0
    if recorded[0][1].channel == "tension":
        expected = (rig.mass or 0.0) * rig.gravity / len(rig.cables)
        pulling = likely[level + span * likely > 0.0]
        likely = pulling if len(pulling) else np.array([np.ceil(-level / span)])
    return span * float(min(likely, key=lambda k: abs(level + span * k - expected)))


def _fault(session: RawSession, group: list[Spotted], column: int) -> SetupFault:
    names, span = devices_of(group), float(np.median([one.value for one in group]))
    unit = _UNITS[group[0].channel]
    unit = unit if isinstance(unit, str) else unit[column]
    step = resolution(group[0].changed.values[:, column])
    bits = next((b for b in (16, 24) if step and abs(span - 2.0**b * step) < 0.5 * step), None)
    width = f", {bits} bits of {step:.4g} {unit}" if bits else ""
    place = where(session, group)
    if group[0].channel != "tension":
        place["axis"] = "xyz"[column % 3]
    count = sum(one.count for one in group)
    verb = "wraps" if len(names) == 1 else "wrap"
    return SetupFault(
        "wrapped_counts", place, {"span": {"value": span, "std": 0.0, "unit": unit}},
        f"{listed(names)} {verb} around by {span:.6g} {unit}{width} in {of_recordings(session, group)}: "
        f"past one end of its span it goes on at the other. The span is added in {count} samples.",
        "Read the converter as a signed number of its full width, and keep the load within its range.",
        "", True, sum(one.gain for one in group),
    )  # fmt: skip
