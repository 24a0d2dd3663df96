"""One topic's messages turned into a clean series, with an account of what was left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.cleaning.clipping import Limit, limits
from rig_identification.cleaning.damaged import without_damaged
from rig_identification.cleaning.stamps import StampSelection, select_stamps
from rig_identification.errors import InputError
from rig_identification.raw import RawChannel
from rig_identification.recording import ChannelQuality, Overrange, Series
from rig_identification.topics import Topic

_SECOND = 1e9
#: Channels whose sensor has an end of range and steps: device, quantity, axis and unit of each column.
COLUMNS: dict[str, tuple[tuple[str | None, str, str | None, str], ...]] = {
    "tension": ((None, "tension", None, "N"),),
    "exciter_force": tuple(("exciter", "force", a, "N") for a in "xyz"),
    "imu": (
        *(("imu", "angular_rate", a, "rad/s") for a in "xyz"),
        *(("imu", "specific_force", a, "m/s^2") for a in "xyz"),
    ),
    "inclination": tuple(("inclinometer", "inclination", a, "rad") for a in "xy"),
}
#: Channels of which a sample is used where any of its numbers was measured.
IN_PART = ("imu", "inclination", "mocap")
#: Channels that carry a quaternion in columns 3 to 6.
_POSES = ("mocap", "ground_truth")
_POSE_WIDTH = 7
_GAP = 1.5  # median intervals
#: Samples after which a value that never changes is worth a note.
_STUCK = 50


@dataclass(frozen=True)
class Channel:
    """Usable samples of one topic, stamps still in ns, before the recording's start is known."""

    topic: Topic
    stamp_ns: NDArray[
        np.int64
    ]  # (n,) strictly increasing; samples that are not finite, clipped or nearly so are left out
    values: NDArray[np.float64]  # (n, width)
    count: int  # messages in the bag
    selection: StampSelection
    ordered_ns: NDArray[np.int64]  # (m,) stamps of all kept messages, whatever their values
    not_finite: int
    clipped: int
    notes: tuple[str, ...]
    stuck: tuple[tuple[Limit, NDArray[np.int64]], ...] = ()  # ends of range, and the stamps (k,) there

    def series(self, start_ns: int) -> Series | None:
        """Samples against seconds after ``start_ns``; None where nothing was measured."""
        if not len(self.stamp_ns):
            return None
        return Series((self.stamp_ns - start_ns) / _SECOND, self.values)

    def quality(self, start_ns: int, *extra_notes: str) -> ChannelQuality:
        """Account of the topic for the report."""
        steps = np.diff(self.ordered_ns)
        median = float(np.median(steps)) if len(steps) else 0.0
        gaps = steps[steps > _GAP * median]
        used = self.stamp_ns if len(self.stamp_ns) else self.ordered_ns
        return ChannelQuality(
            topic=self.topic.name,
            count=self.count,
            used=len(self.stamp_ns),
            rate=_SECOND / median if median else 0.0,
            start=float((used[0] - start_ns) / _SECOND),
            end=float((used[-1] - start_ns) / _SECOND),
            gaps=len(gaps),
            missing=int(np.sum(np.round(gaps / median) - 1)) if len(gaps) else 0,
            longest_gap=float(gaps.max() / _SECOND) if len(gaps) else 0.0,
            duplicated=self.selection.duplicated,
            backward=self.selection.backward,
            not_finite=self.not_finite,
            clipped=self.clipped,
            notes=self.selection.notes + self.notes + extra_notes,
            overranges=tuple(self._overrange(limit, stamps, start_ns) for limit, stamps in self.stuck),
        )

    def _overrange(self, limit: Limit, stamps: NDArray[np.int64], start_ns: int) -> Overrange:
        device, quantity, axis, unit = COLUMNS[self.topic.channel][limit.column]
        first, last = (float((stamps[k] - start_ns) / _SECOND) for k in (0, -1))
        name = device or str(self.topic.cable)
        return Overrange(name, quantity, axis, unit, limit.value, len(stamps), first, last)


def clean_channel(raw: RawChannel, where: str, *, moving: bool = False) -> Channel:
    """Choose the usable samples of one topic; ``where`` is the bag, for messages.

    moving: the body moves in the recording.

    Raises
    ------
    InputError
        No message has a usable stamp.
    """
    selection = select_stamps(raw.stamp_ns, raw.received_ns)
    if not len(selection.kept):
        raise InputError(
            f"{where}: {raw.topic}: none of {len(raw.stamp_ns)} stamps is usable; "
            "stamp the messages when measured"
        )
    topic = Topic(raw.topic, raw.channel, raw.message_type, raw.cable)
    kept = selection.kept
    return _clean(topic, len(raw.stamp_ns), selection, raw.stamp_ns[kept], raw.values[kept], moving)


def _clean(
    topic: Topic,
    count: int,
    selection: StampSelection,
    stamp_ns: NDArray[np.int64],
    values: NDArray[np.float64],
    moving: bool,
) -> Channel:
    values = without_damaged(values).copy()
    notes: tuple[str, ...] = ()
    if topic.channel in _POSES:
        values = _with_unit_quaternions(values)
    held = _filled(values) if moving and topic.channel in IN_PART else []
    values[:, held] = np.nan
    none = _without_cell(values) if topic.channel == "exciter_force" else []
    values[:, none] = 0.0
    known = np.isfinite(values)
    finite = known.any(axis=1) if topic.channel in IN_PART else known.all(axis=1)
    if not finite.any():
        notes = ("never a number in every field: taken as not measured",)
    elif held:
        names = ", ".join(_names(topic.channel)[k] for k in held)
        notes = (f"{names}: one and the same number in every message, taken as not measured",)
    elif none:
        notes = (f"{', '.join(_names(topic.channel)[k] for k in none)}: not measured, taken as zero",)
    elif topic.channel in COLUMNS and len(values) >= _STUCK and not _changes(values[finite]).any():
        notes = ("the values never change: the device may be stuck or switched off",)
    clipped = np.zeros(len(values), bool)
    ends = limits(values[finite]) if topic.channel in COLUMNS else []
    used = finite.copy()
    for end in ends:
        clipped[finite] |= end.stuck
        used[finite] &= ~end.reached
    stuck = tuple((end, stamp_ns[finite][end.stuck]) for end in ends)
    return Channel(
        topic, stamp_ns[used], np.ascontiguousarray(values[used]), count, selection, stamp_ns,
        int(np.count_nonzero(~finite)), int(np.count_nonzero(clipped)), notes, stuck,
    )  # fmt: skip


def _without_cell(values: NDArray[np.float64]) -> list[int]:
    """Columns of an exciter's force that never hold a number, where others do.

    An exciter has a cell along each axis that it pushes along: an unbalanced mass pushes within its plane.
    """
    known = np.isfinite(values).any(axis=0)
    return [int(k) for k in np.flatnonzero(~known)] if known.any() else []


def _filled(values: NDArray[np.float64]) -> list[int]:
    """Columns that hold one and the same number throughout, where others of the device change.

    A device that measures something that moves never does so: its noise alone, or the step of its converter,
    changes the last digit. Whoever wrote the messages put a number where nothing was measured.
    """
    changes = _changes(values)
    if len(values) < _STUCK or not changes.any():
        return []
    still = ~changes & (np.count_nonzero(np.isfinite(values), axis=0) >= _STUCK)
    if values.shape[1] == _POSE_WIDTH:
        # Of a turn only two zeros beside the third axis may stand for what was not measured
        zero = still[3:6] & ~np.nan_to_num(values[:, 3:6]).any(axis=0)
        still[3:] = [*(zero if np.count_nonzero(zero) == 2 else np.zeros(3, bool)), False]
    return [int(k) for k in np.flatnonzero(still)]


def _changes(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(width,) which columns hold more than one number."""
    highest = np.max(values, axis=0, where=np.isfinite(values), initial=-np.inf)
    lowest = np.min(values, axis=0, where=np.isfinite(values), initial=np.inf)
    return np.asarray(highest > lowest)


def _names(channel: str) -> list[str]:
    """What each column of a channel is called."""
    if channel in COLUMNS:
        return [f"{quantity} {axis}".replace("_", " ") for _, quantity, axis, _ in COLUMNS[channel]]
    return [*(f"position {a}" for a in "xyz"), *(f"orientation {a}" for a in "xyzw")]


def _with_unit_quaternions(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions scaled to norm 1; a pose with one of norm 0 or far from 1 is none and becomes NaN.

    w and one of x, y, z with NaN in the two others: a turn about that axis, and nothing is known of others.
    Of two numbers otherwise, or three, no turn can be told.
    """
    unit = np.array(values)
    turns = unit[:, 3:7]
    known = np.isfinite(turns)
    one_axis = known[:, 3] & (np.count_nonzero(known[:, :3], axis=1) == 1)
    turns[~(known.all(axis=1) | one_axis)] = np.nan
    norms = np.sqrt(np.nansum(turns**2, axis=1, keepdims=True))
    told = np.isfinite(turns[:, 3])
    unit[told & (np.abs(norms[:, 0] - 1.0) > 0.1)] = np.nan
    norms[~told] = np.nan
    norms[np.abs(norms - 1.0) < 1e-12] = 1.0  # a second reading changes nothing
    turns /= norms
    return unit
