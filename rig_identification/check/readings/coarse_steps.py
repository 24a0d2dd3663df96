"""A channel whose converter's steps are coarser than its noise: what lies between two steps is not read.

Where noise spreads over a step, rounding is one more white noise of step / sqrt(12). Where it does not,
the error of rounding follows the signal: it does not average out, at rest it stays what it is, and a fit
that takes it for noise is sure of what it cannot know. What such a channel does tell exactly is when its
signal passes from one step to the next: there it is half-way between both. These samples are kept, with
that value; all others say no more than that the signal stays within a step, and are left out.

A law without a name: the recording contract has none for it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from rig_identification.check.found import Found
from rig_identification.check.readings.channel_model import (
    Array,
    channels_of,
    resolution,
)
from rig_identification.check.readings.telling import Spotted, told, where
from rig_identification.cleaning.channel import COLUMNS
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession

#: Behind what repeats, is averaged or frozen: those channels have steps of their own making.
ORDER = 60
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
    out: list[Found] = []
    for (_, name), recorded in channels_of(session):
        moving = [channel for number, channel in recorded if session.recordings[number].kind == "dynamic"]
        for column, (_, quantity, axis, unit) in enumerate(COLUMNS.get(name, ())):
            step = _step([channel.values[:, column] for channel in moving])
            noise = session.rig.noise.get(quantity if name == "imu" else name, np.inf)
            if step > np.sqrt(12.0) * noise:
                now = out[-1].session if out else session
                # As they are now: another component of the same channel may have been changed
                channels = [(n, _same(now.recordings[n], channel)) for n, channel in recorded]
                spotted = [_passages(n, channel, column, step) for n, channel in channels]
                fault = partial(_fault, quantity=quantity, axis=axis, unit=unit, noise=noise)
                out += told(now, [spotted], fault)
    return tuple(out)


def _same(recording: RawRecording, channel: RawChannel) -> RawChannel:
    return next(c for c in recording.channels if c.topic == channel.topic)


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


def _passages(number: int, channel: RawChannel, column: int, step: float) -> Spotted:
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


def _fault(
    session: RawSession, group: list[Spotted], quantity: str, axis: str | None, unit: str, noise: float
) -> SetupFault:
    step = group[0].value
    place = where(session, group) | {"axis": axis, "quantity": quantity, "law": "steps"}
    what = quantity.replace("_", " ") + (f" along {axis}" if axis else "")
    return SetupFault(
        "unknown", place, {"step": {"value": step, "std": 0.0, "unit": unit}},
        f"{group[0].device} reads {what} in steps of {step:.4g} {unit}, {step / noise:.0f} times its noise: "
        f"what lies between two is lost. Only the {sum(one.count for one in group)} samples where it passes "
        "from one step to the next are used.",
        "Set a smaller range or a higher resolution of the converter, and let the driver write all its bits.",
        "", True, sum(one.gain for one in group),
    )  # fmt: skip
