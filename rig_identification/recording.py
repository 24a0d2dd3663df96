"""What was recorded: frozen time series, SI units, no files and no ROS.

Times are seconds after the recording's first stamp (over all its topics), as measured by
the clock of each device; ``Recording.start_ns`` is that first stamp.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Series:
    """Samples of one device on its own clock, strictly increasing in time.

    A number that is NaN was not measured. Every sample holds one that was.
    """

    time: Array  # (n,) s after the recording's start
    values: Array  # (n, width)

    def parts(self, columns: slice = slice(None)) -> tuple[Part, ...]:
        """Which of ``columns`` were measured together, and when; what was measured most often comes first.

        A device that always measures all of them makes one part of all its samples, in which every number is
        finite. So does every other part, of the samples and the columns that it holds.
        """
        values = self.values[:, columns]
        indices = np.arange(self.values.shape[1])[columns]
        known = np.isfinite(values)
        if known.all():
            return (Part(tuple(indices.tolist()), Series(self.time, values)),) if known.size else ()
        kinds, member, counts = np.unique(known, axis=0, return_inverse=True, return_counts=True)
        out = []
        for kind in np.argsort(-counts, kind="stable").tolist():
            held, rows = kinds[kind], member.ravel() == kind
            if held.any():
                of_part = Series(self.time[rows], np.ascontiguousarray(values[rows][:, held]))
                out.append(Part(tuple(indices[held].tolist()), of_part))
        return tuple(out)


@dataclass(frozen=True)
class Part:
    """What a device measured together."""

    components: tuple[int, ...]  # columns of the device's series, ascending
    series: Series  # (n, len(components)), finite


@dataclass(frozen=True)
class Overrange:
    """One component of what a device measures, at an end of the device's range."""

    device: str  # a cable's name, "imu", "inclinometer" or "exciter"
    quantity: str  # "tension", "angular_rate", "specific_force", "inclination" or "force"
    axis: str | None  # "x", "y", "z" or None
    unit: str
    limit: float  # in that unit
    samples: int
    start: float  # s after the recording's start, first such sample
    end: float  # s, last one


@dataclass(frozen=True)
class ChannelQuality:
    """What was found in one topic before it was used."""

    topic: str
    count: int  # messages in the bag
    used: int  # samples that went into Series
    rate: float  # Hz, median
    start: float  # s after the recording's start, first used sample
    end: float  # s, last used sample
    gaps: int  # intervals longer than 1.5 median intervals
    missing: int  # samples that those gaps would hold
    longest_gap: float  # s
    duplicated: int  # stamps equal to an earlier one
    backward: int  # stamps before an earlier one
    not_finite: int  # samples with NaN or infinity where a number is due
    clipped: int  # samples stuck at the extreme value of the channel
    notes: tuple[str, ...] = ()  # sentences for the report
    overranges: tuple[Overrange, ...] = ()  # where and at what value samples are clipped


@dataclass(frozen=True)
class Dummy:
    """A known mass fixed at a known point for one static recording."""

    mass: float  # kg
    position: Array  # (3,) m, body


@dataclass(frozen=True)
class Recording:
    """One bag of a session. A topic that is missing is None (or absent from ``tension``)."""

    name: str
    kind: str  # "static" or "dynamic"
    holdout: bool
    start_ns: int  # first stamp of the recording
    duration: float  # s, from the first to the last stamp
    dummy: Dummy | None = None
    tension: dict[str, Series] = field(default_factory=dict)  # cable name -> (n, 1) N, positive pulls
    exciter_force: Series | None = None  # (n, 3) N, exciter frame, on the body
    exciter_unmeasured: bool = False  # its topic is there and never holds a number (contract: not measured)
    exciter_shaft: Series | None = None  # (n, 2) angle rad, rate rad/s
    imu: Series | None = None  # (n, 6) angular rate rad/s, specific force m/s^2, imu frame
    inclination: Series | None = None  # (n, 2) rad, x and y axis above the horizontal plane
    mocap: Series | None = None  # (n, 7) position m, quaternion xyzw of marker frame in tracker frame
    ground_truth: Series | None = None  # (n, 13) position, quaternion xyzw of body in world; body twist
    quality: tuple[ChannelQuality, ...] = ()
    notes: tuple[str, ...] = ()  # sentences on how the bag was read, for the report


@dataclass(frozen=True)
class Session:
    """One body on one rig on one day."""

    name: str
    rig: Rig
    recordings: tuple[Recording, ...]

    @property
    def statics(self) -> tuple[Recording, ...]:
        """Recordings in which the body hangs at rest."""
        return tuple(r for r in self.recordings if r.kind == "static")

    @property
    def training(self) -> tuple[Recording, ...]:
        """Dynamic recordings that parameters are fitted to."""
        return tuple(r for r in self.recordings if r.kind == "dynamic" and not r.holdout)

    @property
    def holdouts(self) -> tuple[Recording, ...]:
        """Dynamic recordings that only score the fit."""
        return tuple(r for r in self.recordings if r.kind == "dynamic" and r.holdout)
