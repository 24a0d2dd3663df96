"""A run as the estimator sees it: grid, input, and the samples of every channel with their noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.sampling import Grid, group_by_node, sample_noise_std
from rig_identification.recording import Recording, Series
from rig_identification.rig import Rig

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Node spacing of runs up to LONG_RUN seconds, and of longer ones.
NODE_STEP = 0.005
LONG_NODE_STEP = 0.01
LONG_RUN = 150.0
#: Node spacing where a run is only watched: no device follows more than the swing itself, whose pose a
#: cubic through such nodes holds to 1e-4 at 1.5 Hz.
WATCHED_NODE_STEP = 0.025
#: Samples this close to a run's ends are left out, so that a clock offset moves none across the end (s).
MARGIN = 0.02


@dataclass(frozen=True)
class Channel:
    """Samples of one device quantity, grouped by node."""

    device: str  # cable name, "imu", "inclinometer" or "mocap"
    quantity: str
    columns: slice  # of the device's reading (model/sensors.py)
    unit: str
    time: Array  # (n,) s, device clock
    values: Array  # (n, w)
    noise: Array  # (w,) standard deviation of one sample
    noise_estimated: bool
    group: Index  # (n,)
    node: Index  # (groups,)

    @property
    def width(self) -> int:
        """Number of axes."""
        return int(self.values.shape[1])

    @property
    def grouped(self) -> Array:
        """(groups, w) mean of each group."""
        count = np.bincount(self.group)
        return np.stack([np.bincount(self.group, v) / count for v in self.values.T], axis=1)

    @property
    def grouped_variance(self) -> Array:
        """(groups, w) variance of each group's mean."""
        return np.asarray(self.noise**2 / np.bincount(self.group)[:, None])


@dataclass(frozen=True)
class Run:
    """One dynamic recording, ready to be fitted."""

    recording: Recording
    grid: Grid
    channels: tuple[Channel, ...]
    exciter: Series | None
    exciter_noise: float  # N, one sample
    exciter_rate: float  # Hz
    R_tracker_mean: Array | None = None  # (3, 3) see sensors.mocap
    offset: float = 0.0  # s after the recording's start at which node 0 lies

    def until(self, end: float) -> Run:
        """The same run, cut off at ``end`` seconds."""
        return self.between(0, round(end / self.grid.step), margin=MARGIN)

    def between(self, first: int, last: int, margin: float = 0.0) -> Run:
        """Nodes ``first`` to ``last`` as a run of their own; its time starts at node ``first``."""
        last = min(self.grid.nodes - 1, max(first + 7, last))
        grid = replace(self.grid, nodes=last - first + 1)
        shift = first * self.grid.step
        cut = []
        for channel in self.channels:
            time = channel.time - shift
            inside = (time >= 0.0) & (time <= grid.duration - margin)
            if not np.any(inside):
                continue
            group, node = group_by_node(grid, time[inside])
            cut.append(
                replace(channel, time=time[inside], values=channel.values[inside], group=group, node=node)
            )
        exciter = self.exciter
        if exciter is not None:
            # Two extra intervals on either side, so that the input's spline feels no edge
            near = (exciter.time >= shift - 2 * grid.step) & (
                exciter.time <= shift + grid.duration + 2 * grid.step
            )
            exciter = Series(exciter.time[near] - shift, exciter.values[near]) if np.any(near) else None
        return replace(self, grid=grid, channels=tuple(cut), exciter=exciter, offset=self.offset + shift)


def noise_std(rig: Rig, name: str, time: Array, values: Array) -> tuple[Array, bool]:
    """(std of one sample (w,), whether it was estimated): described, or read off the samples themselves."""
    width = values.shape[1]
    if name in rig.noise:
        return np.full(width, rig.noise[name]), False
    return np.maximum(sample_noise_std(time, values), 1e-9), True


def _channel(
    rig: Rig, grid: Grid, device: str, quantity: str, unit: str, noise: str, series: Series, columns: slice
) -> Channel | None:
    inside = (series.time >= MARGIN) & (series.time <= grid.duration - MARGIN)
    if np.count_nonzero(inside) < 5:
        return None
    time, values = series.time[inside], series.values[inside]
    std, estimated = noise_std(rig, noise, time, values)
    group, node = group_by_node(grid, time)
    return Channel(device, quantity, columns, unit, time, values, std, estimated, group, node)


def _mocap_series(series: Series) -> tuple[Series, Array]:
    """Pose as position and rotation vector about the mean orientation, and that mean (3, 3)."""
    turns = Rotation.from_quat(series.values[:, 3:])
    mean = turns.mean()
    about_mean = (mean.inv() * turns).as_rotvec()
    return Series(series.time, np.concatenate([series.values[:, :3], about_mean], axis=1)), mean.as_matrix()


def node_step(recording: Recording) -> float:
    """Node spacing (s) that a recording's fastest device needs."""
    fast = (recording.imu, recording.exciter_force, recording.inclination)
    if not recording.tension and all(series is None for series in fast):
        return WATCHED_NODE_STEP
    return NODE_STEP if recording.duration <= LONG_RUN else LONG_NODE_STEP


def prepare(rig: Rig, recording: Recording) -> Run:
    """Everything of a dynamic recording that a fit needs."""
    step = node_step(recording)
    grid = Grid(step, int(np.floor(recording.duration / step)) + 1)
    found: list[Channel | None] = []
    for cable, series in recording.tension.items():
        found.append(_channel(rig, grid, cable, "tension", "N", "tension", series, slice(0, 1)))
    if recording.imu is not None and rig.imu is not None:
        series = recording.imu
        gyro, accel = Series(series.time, series.values[:, :3]), Series(series.time, series.values[:, 3:])
        found.append(_channel(rig, grid, "imu", "angular_rate", "rad/s", "angular_rate", gyro, slice(0, 3)))
        found.append(
            _channel(rig, grid, "imu", "specific_force", "m/s^2", "specific_force", accel, slice(3, 6))
        )
    if recording.inclination is not None and rig.inclinometer is not None:
        series = recording.inclination
        found.append(
            _channel(rig, grid, "inclinometer", "inclination", "rad", "inclination", series, slice(0, 2))
        )
    mean = None
    if recording.mocap is not None:
        series, mean = _mocap_series(recording.mocap)
        place, turn = Series(series.time, series.values[:, :3]), Series(series.time, series.values[:, 3:])
        found.append(_channel(rig, grid, "mocap", "position", "m", "mocap_position", place, slice(0, 3)))
        found.append(
            _channel(rig, grid, "mocap", "orientation", "rad", "mocap_orientation", turn, slice(3, 6))
        )
    exciter = recording.exciter_force if rig.exciter is not None else None
    noise, rate = 0.0, 1.0
    if exciter is not None and exciter.time.size > 8:
        std, _ = noise_std(rig, "exciter_force", exciter.time, exciter.values)
        noise = float(np.sqrt(np.mean(std**2)))
        rate = 1.0 / float(np.median(np.diff(exciter.time)))
    else:
        exciter = None
    return Run(recording, grid, tuple(c for c in found if c is not None), exciter, noise, rate, mean)
