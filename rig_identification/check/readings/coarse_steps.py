"""A channel whose converter's steps are coarser than its noise: what lies between two steps is not read.

Where noise spreads over a step, rounding is one more white noise of step / sqrt(12). Where it does not,
the error of rounding follows the signal: it does not average out, at rest it stays what it is, and a fit
that takes it for noise is sure of what it cannot know. What such a channel does tell exactly is when its
signal passes from one step to the next: there it is half-way between both. These samples are kept, with
that value; all others say no more than that the signal stays within a step, and are left out.

A law without a name: the recording contract has none for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import (
    Array,
    channels_of,
    groups,
    resolution,
)
from rig_identification.check.readings.telling import Spotted, told, where
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession

#: Behind what repeats, is averaged or frozen: those channels have steps of their own making.
ORDER = 60
#: Quantities of a channel: name of their noise in the rig description, unit, axes.
_QUANTITIES = {
    "tension": ("tension", "N", ("",)),
    "exciter_force": ("exciter_force", "N", ("x", "y", "z")),
    "angular_rate": ("angular_rate", "rad/s", ("x", "y", "z")),
    "specific_force": ("specific_force", "m/s^2", ("x", "y", "z")),
    "inclination": ("inclination", "rad", ("x", "y")),
}
#: Two samples that noise does not spread over a step are the same more often than not.
_SAME = 0.5
#: And of the changes this share goes to a neighbouring step: a held sample jumps, noise spreads.
_NEIGHBOURS = 0.9
#: Passages through one value so few samples apart are one, there and back again by noise.
_AGAIN = 4
#: Passages below which nothing is known of a step.
_FEWEST = 10


def find(session: RawSession) -> tuple[Found, ...]:
    """Components that are read in steps coarser than their noise, one fault for each."""
    spotted: dict[tuple[str, str, str], list[Spotted]] = {}
    for (device, _), recorded in channels_of(session):
        moving = [channel for number, channel in recorded if session.recordings[number].kind == "dynamic"]
        for quantity, axis, column in _components([channel for _, channel in recorded]):
            step = _step([channel.values[:, column] for channel in moving])
            noise = session.rig.noise.get(_QUANTITIES[quantity][0], np.inf)
            if step > np.sqrt(12.0) * noise:
                found = [
                    _passages(session.recordings[number], number, channel, column, step)
                    for number, channel in recorded
                ]
                spotted[device, quantity, axis] = found
    out: list[Found] = []
    for (_, quantity, axis), group in spotted.items():
        now = out[-1].session if out else session
        # Two components of one channel may be concerned: each keeps what the other one changed
        fresh = [_onto(now.recordings[one.recording], one) for one in group]
        out += told(now, [fresh], lambda left, one: _fault(left, one, quantity, axis))  # noqa: B023
    return tuple(out)


def _components(channels: list[RawChannel]) -> Iterator[tuple[str, str, int]]:
    """Quantity, axis and column of what varies in any recording of a channel."""
    known: dict[str, set[int]] = {}
    for channel in channels:
        for quantity, varying in groups(channel).items():
            known.setdefault(quantity, set()).update(varying)
    for quantity, columns in known.items():
        if quantity in _QUANTITIES:
            axes = _QUANTITIES[quantity][2]
            first = 3 if quantity == "specific_force" else 0
            yield from ((quantity, axes[k - first], k) for k in sorted(columns))


def _step(columns: list[Array]) -> float:
    """Step of a component over which noise does not spread it, where the body moves; 0: none."""
    columns = [column[np.isfinite(column)] for column in columns]
    changes = [np.diff(column) for column in columns if len(column) > 1]
    if not changes:
        return 0.0
    change = np.abs(np.concatenate(changes))
    step = resolution(np.concatenate(columns))
    passed = change > 0.0
    if step == 0.0 or np.count_nonzero(passed) < _FEWEST or np.mean(passed) > 1.0 - _SAME:
        return 0.0
    return step if np.mean(change[passed] < 1.5 * step) > _NEIGHBOURS else 0.0


def _passages(recording: RawRecording, number: int, channel: RawChannel, column: int, step: float) -> Spotted:
    """The channel with the sample next to each passage half-way between the steps, and no others."""
    values = channel.values.copy()
    values[:, column] = _halfway(channel.values[:, column], step)
    kept = int(np.count_nonzero(np.isfinite(values[:, column])))
    return Spotted(
        channel.device, channel.channel, number, replace(channel, values=values), (), kept, float(kept), step
    )


def _halfway(column: Array, step: float) -> Array:
    """(n,) half-way between two neighbouring steps at the sample next to each passage, NaN elsewhere.

    Noise makes a slow signal pass there and back again: such passages are one, in their middle, or none
    where the signal stays on its side. From the passage to the sample the signal moves as from the passage
    before to the one behind.
    """
    change = np.diff(column)
    at = np.flatnonzero((np.abs(change) > 0.0) & (np.abs(change) < 1.5 * step))
    out = np.full(len(column), np.nan)
    if len(at) < 2:
        return out
    middle = 0.5 * (column[at] + column[at + 1])
    fresh = (np.diff(at) > _AGAIN) | (np.abs(np.diff(middle)) > 0.5 * step)
    group = np.concatenate(([0], np.cumsum(fresh)))
    size = np.bincount(group)
    through = size % 2 == 1
    time, value = (np.bincount(group, one)[through] / size[through] for one in (at + 0.5, middle))
    nearest = np.rint(time).astype(int)
    slope = np.gradient(value, time) if len(time) > 1 else np.zeros(len(time))
    out[nearest] = value + slope * (nearest - time)
    return out


def _onto(recording: RawRecording, one: Spotted) -> Spotted:
    """What was spotted, on the channel as it is now: columns that it does not concern stay."""
    now = next(c for c in recording.channels if c.topic == one.changed.topic)
    kept = np.isfinite(one.changed.values) & np.isfinite(now.values)
    return replace(one, changed=replace(one.changed, values=np.where(kept, one.changed.values, np.nan)))


def _fault(session: RawSession, group: list[Spotted], quantity: str, axis: str) -> SetupFault:
    name, unit, _ = _QUANTITIES[quantity]
    step, noise = group[0].value, session.rig.noise[name]
    place = where(session, group) | {"axis": axis or None, "quantity": quantity, "law": "steps"}
    what = quantity.replace("_", " ") + (f" along {axis}" if axis else "")
    return SetupFault(
        "unknown", place, {"step": {"value": step, "std": 0.0, "unit": unit}},
        f"{group[0].device} reads {what} in steps of {step:.4g} {unit}, {step / noise:.0f} times its noise: "
        f"what lies between two is lost. Only the {sum(one.count for one in group)} samples where it passes "
        "from one step to the next are used.",
        "Set a smaller range or a higher resolution of the converter, and let the driver write all its bits.",
        "", True, sum(one.gain for one in group),
    )  # fmt: skip
