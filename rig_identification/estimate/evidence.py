"""A run as the estimator sees it: grid, input, and the samples of every channel with their noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.force_gaps import bridged
from rig_identification.estimate.noise import noise_std
from rig_identification.estimate.pose_error import Turning
from rig_identification.estimate.sampling import (
    Grid,
    NodeInput,
    Sampler,
    cubic_error,
    group_by_node,
    node_input,
    noise_felt,
    worst_cubic_error,
)
from rig_identification.estimate.smooth_force import smooth_force
from rig_identification.recording import Part, Recording, Series
from rig_identification.rig import Rig

if TYPE_CHECKING:
    from rig_identification.estimate.noise_at_rest import Colour

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: Node spacing of runs up to LONG_RUN seconds that hold fast motion (snaps, bounces, steps of force); of
#: longer ones, and of all whose samples a cubic through wider nodes follows.
NODE_STEP = 0.005
WIDE_NODE_STEP = 0.01
LONG_RUN = 150.0
#: Where the force is sampled more seldom than this, in wide node steps, nodes lie as far apart as its
#: samples: the error of a sample lasts until the next one, and is white only from node to node.
SELDOM = 1.5
#: Root mean square error of that cubic, in units of one sample's noise, up to which it follows: of a whole
#: run, and of its worst second, in which 0.8 is still chance.
FOLLOWED, FOLLOWED_AT_WORST = 0.1, 1.0
#: Node spacing where a run is only watched: no device follows more than the swing itself, whose pose a
#: cubic through such nodes holds to 1e-4 at 1.5 Hz.
WATCHED_NODE_STEP = 0.025
#: Nodes in a swing where nothing but the turn about the vertical is measured, and their longest spacing (s).
#: A Runge-Kutta step keeps the swing's frequency to (2 pi / 64)^4 / 120 = 8e-7, a cubic its angle to 2e-6.
#: What the body does faster, rolling at some hertz, no such device feels.
SWING_NODES, LONGEST_NODE_STEP = 64.0, 0.1
#: Samples this close to a run's ends are left out, so that a clock offset moves none across the end (s).
MARGIN = 0.02
#: Between two gaps of the force a shorter part (s) tells hardly more than its own start state.
SHORTEST_PART = 1.0
#: s of silence at a run's beginning that are cut off: a fit begins with less than twice as much of a run, and
#: where nothing but the force is heard nothing tells its start state.
UNHEARD = 0.2
#: Node intervals either way of a jump of force from which samples are left out, and the share of a channel
#: that must be left.
BESIDE_JUMP, LEFT = 3.0, 0.5


#: Components of a quantity that has a direction; those of a device's quantities stand one after the other.
AXES = 3


def columns_of(components: tuple[int, ...]) -> slice | Index:
    """Columns of a device's reading: a slice where they lie side by side, of which a view is enough."""
    first, last = components[0], components[-1]
    if last - first + 1 == len(components):
        return slice(first, last + 1)
    return np.array(components, dtype=np.int64)


def axis_name(quantity: str, axis: int) -> str | None:
    """``x``, ``y`` or ``z``; a tension has no axes."""
    return None if quantity == "tension" else "xyz"[axis]


@dataclass(frozen=True)
class Channel:
    """Samples of one device quantity, grouped by node."""

    device: str  # cable name, "imu", "inclinometer" or "mocap"
    quantity: str
    components: tuple[int, ...]  # of the device's reading (model/sensors.py), ascending
    unit: str
    time: Array  # (n,) s, device clock
    values: Array  # (n, w)
    noise: Array  # (w,) standard deviation of one sample
    noise_estimated: bool
    group: Index  # (n,)
    node: Index  # (groups,)
    felt: float = 1.0  # std of the exciter's noise that a group feels at once, in that of an interval's mean
    wander: Array | None = None  # (w,) std of a tracker's error that goes with the pose (pose_error.py)
    slow: Array | None = None  # (w,) factor on the noise at the motion's frequencies (noise_at_rest.py)
    colour: Colour | None = None  # that noise at every frequency

    @property
    def width(self) -> int:
        """Number of axes."""
        return len(self.components)

    @cached_property
    def columns(self) -> slice | Index:
        """Where its components stand in the device's reading."""
        return columns_of(self.components)

    @property
    def key(self) -> tuple[str, str, tuple[int, ...]]:
        """What it measures, in every run."""
        return self.device, self.quantity, self.components

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """Which axis (0, 1, 2) each of its components is of."""
        return tuple(c % AXES for c in self.components)

    def axis_name(self, axis: int) -> str | None:
        """``x``, ``y`` or ``z`` of one of its axes; a tension has none."""
        return axis_name(self.quantity, axis)

    @cached_property
    def in_order(self) -> bool:
        """Whether no sample lies before the one before it."""
        return bool(np.all(np.diff(self.time) >= 0.0))

    def about(self, start: float, end: float) -> slice:
        """A few samples more than those from ``start`` to ``end`` s."""
        if not self.in_order:
            return slice(None)
        first, last = np.searchsorted(self.time, [start, end])
        return slice(max(0, int(first) - 1), int(last) + 2)

    def power_of_noise(self, axis: int, frequency: Array) -> Array:
        """(n,) that one of its axes has at frequencies (n,) Hz, in that of the white noise it is taken for.

        Not below 1: noise that is quieter in one recording than at rest is no evidence of anything.
        """
        if self.colour is None or self.slow is None:
            return np.ones_like(frequency)
        place = self.axes.index(axis)
        power = self.colour.power(frequency)[:, place] / self.slow[place] ** 2
        return np.asarray(np.maximum(power, 1.0))

    def keeping(self, kept: NDArray[np.bool_], grid: Grid) -> Channel:
        """The channel with those of its samples (n,) alone that are ``kept``."""
        time = self.time[kept]
        group, node = group_by_node(grid, time)
        return replace(self, time=time, values=self.values[kept], group=group, node=node)

    @cached_property
    def grouped(self) -> Array:
        """(groups, w) mean of each group."""
        count = np.bincount(self.group)
        return np.stack([np.bincount(self.group, v) / count for v in self.values.T], axis=1)

    @cached_property
    def grouped_variance(self) -> Array:
        """(groups, w) variance of each group's mean."""
        noise = self.noise if self.slow is None else self.noise * self.slow
        return np.asarray(noise**2 / np.bincount(self.group)[:, None])


@dataclass(frozen=True)
class Run:
    """One dynamic recording, ready to be fitted."""

    recording: Recording
    grid: Grid
    channels: tuple[Channel, ...]
    force: NodeInput | None  # measured exciter force at the nodes, exciter frame, N
    exciter_noise: float  # N, one sample
    exciter_rate: float  # Hz
    R_tracker_mean: Array | None = None  # (3, 3) see sensors.mocap
    offset: float = 0.0  # s after the recording's start at which node 0 lies
    unknown: tuple[tuple[float, float], ...] = ()  # stretches (s) whose force is not known (force_gaps.py)
    out_of: float = 0.0  # s of the run of which this is the liveliest stretch (enough.py); 0: it is not cut
    lively: float = 1.0  # share of that whole run's motion that is in the stretch
    turning: Turning | None = None  # by which turn a tracker's error goes, where it does

    @cached_property
    def samplers(self) -> tuple[Sampler, ...]:
        """How each channel samples what the nodes hold."""
        return tuple(Sampler(self.grid, c.time, c.group, c.node.size) for c in self.channels)

    @cached_property
    def pose_shapes(self) -> dict[int, tuple[Array, Array]]:
        """What a tracker's error may be, by channel: (n, k) at each sample and (groups, k) at each group."""
        seen = [c for c in self.channels if self.turning is not None and c.key == self.turning.key]
        if self.turning is None or not seen:
            return {}
        angle, out = self.turning.angle(seen[0].values), {}
        for index, c in enumerate(self.channels):
            if c.wander is not None:
                shapes = self.turning.shapes(np.interp(c.time, seen[0].time, angle))
                out[index] = shapes, replace(c, values=shapes).grouped
        return out

    @property
    def begins(self) -> tuple[str, float]:
        """Where it begins: its recording, and s into that. A run and its first piece begin alike."""
        return self.recording.name, self.offset

    @property
    def watched(self) -> bool:
        """Whether motion capture sees the body in it."""
        return any(c.device == "mocap" for c in self.channels)

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
            near = channel.about(shift, shift + grid.duration)
            time = channel.time[near] - shift
            inside = (time >= 0.0) & (time <= grid.duration - margin)
            if not np.any(inside):
                continue
            group, node = group_by_node(grid, time[inside])
            values = channel.values[near][inside]
            cut.append(replace(channel, time=time[inside], values=values, group=group, node=node))
        # The input is cut, not made anew: at an edge a spline knows half as much
        force = None if self.force is None else self.force.between(first, last)
        offset = self.offset + shift
        cut_off = replace(self, grid=grid, channels=tuple(cut), force=force, offset=offset, unknown=())
        return cut_off if cut_off.watched else replace(cut_off, R_tracker_mean=None)

    def with_wide_nodes(self) -> Run:
        """The same run with every second node; samples nearest the same node are averaged together."""
        grid = Grid(2.0 * self.grid.step, (self.grid.nodes + 1) // 2)
        channels = []
        for channel in self.channels:
            group, node = group_by_node(grid, channel.time)
            channels.append(replace(channel, group=group, node=node))
        force = None if self.force is None else self.force.at_every_second(grid.nodes)
        return replace(self, grid=grid, channels=tuple(channels), force=force)

    def where_driven(self) -> tuple[Run, ...]:
        """The run's parts between stretches in which its force is not known, from its first reading on."""
        heard = min((float(c.time[0]) for c in self.channels), default=0.0)
        begins = heard if heard > UNHEARD else 0.0
        if not (self.unknown or begins):
            return (self,)
        edges = [0.0, *(edge for stretch in self.unknown for edge in stretch), self.grid.duration]
        parts = []
        for start, end in zip(edges[::2], edges[1::2], strict=True):
            first, last = int(np.ceil(max(start, begins) / self.grid.step)), int(end / self.grid.step)
            if (last - first) * self.grid.step > SHORTEST_PART:
                parts.append(self.between(first, last, margin=MARGIN))
        return tuple(parts)


def _channels(
    rig: Rig, grid: Grid, device: str, quantity: str, unit: str, series: Series, columns: slice
) -> list[Channel]:
    """One channel for each part of a quantity that is measured together; none where nothing is."""
    name = f"{device}_{quantity}" if device == "mocap" else quantity
    parts = [_part_channel(rig, grid, device, quantity, unit, name, part) for part in series.parts(columns)]
    return [channel for channel in parts if channel is not None]


def _part_channel(
    rig: Rig, grid: Grid, device: str, quantity: str, unit: str, noise: str, part: Part
) -> Channel | None:
    series = part.series
    inside = (series.time >= MARGIN) & (series.time <= grid.duration - MARGIN)
    if np.count_nonzero(inside) < 5:
        return None
    time, values = series.time[inside], series.values[inside]
    std, estimated = noise_std(rig, noise, time, values)
    group, node = group_by_node(grid, time)
    return Channel(device, quantity, part.components, unit, time, values, std, estimated, group, node)


def heard_apart(rig: Rig, part: Run) -> Run:
    """A stretch of a run with the noise of its own samples, where what it was cut from sounds louder."""
    channels = []
    for c in part.channels:
        name = f"mocap_{c.quantity}" if c.device == "mocap" else c.quantity
        own, estimated = noise_std(rig, name, c.time, c.values)
        quieter = own < c.noise
        channels.append(
            replace(
                c,
                noise=np.where(quieter, own, c.noise),
                noise_estimated=estimated if np.all(quieter) else c.noise_estimated,
            )
        )
    return replace(part, channels=tuple(channels))


def _mocap_series(series: Series) -> tuple[Series, Array]:
    """Pose as position and rotation vector about the mean orientation, and that mean (3, 3).

    A turn about one axis of the tracker alone is a rotation vector along that axis.
    """
    quaternions = series.values[:, 3:]
    known = np.isfinite(quaternions)
    turned = known[:, 3] & known[:, :3].any(axis=1)
    about_mean, mean = np.full((series.time.size, 3), np.nan), Rotation.identity()
    if turned.any():
        turns = Rotation.from_quat(np.where(known, quaternions, 0.0)[turned])
        mean = turns.mean()
        about_mean[turned] = np.where(known[turned, :3], (mean.inv() * turns).as_rotvec(), np.nan)
    return Series(series.time, np.concatenate([series.values[:, :3], about_mean], axis=1)), mean.as_matrix()


def node_step(rig: Rig, recording: Recording) -> float:
    """Node spacing (s) that a recording's fastest device needs."""
    if _only_turns(recording):
        # What a cubic through such nodes does not follow, no swing of a rigid body is either
        turn = _vertical_turn(recording)
        if turn is None:
            return WATCHED_NODE_STEP
        return float(np.clip(_period(turn) / SWING_NODES, WATCHED_NODE_STEP, LONGEST_NODE_STEP))
    held = _force_step(rig, recording)
    if held > SELDOM * WIDE_NODE_STEP and _all_follow(rig, recording, held):
        return held
    if recording.duration > LONG_RUN or _all_follow(rig, recording, WIDE_NODE_STEP):
        return WIDE_NODE_STEP
    return NODE_STEP


def _vertical_turn(recording: Recording) -> Series | None:
    """The turn about z, or its rate, where that is all that was measured."""
    found: list[Series] = []
    for series, z in ((recording.imu, 2), (recording.mocap, 5)):
        if series is None:
            continue
        known = {int(k) for k in np.flatnonzero(np.isfinite(series.values).any(axis=0))}
        # A quaternion's fourth number belongs to each of the three
        if known - ({6} if series is recording.mocap else set()) != {z}:
            return None
        kept = np.isfinite(series.values[:, z])
        found.append(Series(series.time[kept], series.values[kept][:, [z]]))
    return found[0] if len(found) == 1 and found[0].time.size >= 16 else None


def _period(series: Series) -> float:
    """Period (s) of the strongest line of samples (n, 1)."""
    centred = series.values[:, 0] - np.mean(series.values[:, 0])
    power = np.abs(np.fft.rfft(centred * np.hanning(centred.size)))
    step = float(series.time[-1] - series.time[0]) / (centred.size - 1)
    return float(step * centred.size / (int(np.argmax(power[1:])) + 1))


def _only_turns(recording: Recording) -> bool:
    """Whether nothing that shows a jolt or a force is measured, a gyroscope at most."""
    quick = (recording.exciter_force, recording.inclination)
    jolts = recording.imu is not None and bool(recording.imu.parts(slice(3, 6)))
    return not recording.tension and all(series is None for series in quick) and not jolts


def _force_step(rig: Rig, recording: Recording) -> float:
    """Median time (s) between two samples of the exciter's force; 0 where it is not used."""
    force = recording.exciter_force if rig.exciter is not None else None
    return 0.0 if force is None or force.time.size < 16 else float(np.median(np.diff(force.time)))


def _all_follow(rig: Rig, recording: Recording, step: float) -> bool:
    """Whether a cubic through nodes ``step`` apart follows tensions, rates and specific forces."""
    follows = [_follows(rig, "tension", series, step) for series in recording.tension.values()]
    if recording.imu is not None:
        for name, columns in (("angular_rate", slice(0, 3)), ("specific_force", slice(3, 6))):
            parts = recording.imu.parts(columns)
            follows += [_follows(rig, name, part.series, step) for part in parts]
    return all(follows)


def _follows(rig: Rig, name: str, series: Series, step: float) -> bool:
    """Whether a cubic through nodes ``step`` apart follows samples to a part of their noise."""
    if series.time.size < 16:
        return True
    noise, _ = noise_std(rig, name, series.time, series.values)
    if not np.all(cubic_error(series.time, series.values, noise, step) < FOLLOWED * noise):
        return False
    worst = worst_cubic_error(series.time, series.values, noise, step)
    return bool(np.all(worst < FOLLOWED_AT_WORST * noise))


def away_from_jumps(run: Run) -> Run:
    """The run without samples beside a jump of its exciter's force.

    The force is known by samples some ms apart and a line between nodes: through a jump that line overshoots
    by a sixth for two nodes either way, and load cells and accelerometers feel it at once. In the thesis'
    case 7, three jumps of 300 N on a light body, samples there are off by up to 50 sigma.
    """
    if run.force is None or not np.any(run.force.jumps):
        return run
    step = run.grid.step
    middles = step * (np.flatnonzero(np.any(run.force.jumps != 0.0, axis=1)) + 0.5)
    channels = []
    for channel in run.channels:
        after = (
            np.clip(np.searchsorted(middles, channel.time), 1, middles.size - 1) if middles.size > 1 else 0
        )
        nearest = np.minimum(np.abs(channel.time - middles[after]), np.abs(channel.time - middles[after - 1]))
        kept = nearest > BESIDE_JUMP * step
        if np.count_nonzero(kept) < LEFT * kept.size:
            # A force that does nothing but jump: what is beside its jumps is all there is
            return run
        channels.append(channel.keeping(kept, run.grid))
    return replace(run, channels=tuple(channels))


def prepare(rig: Rig, recording: Recording, step: float | None = None) -> Run:
    """Everything of a dynamic recording that a fit needs. step: between nodes, s (none: what it takes)."""
    step = step or node_step(rig, recording)
    grid = Grid(step, int(np.floor(recording.duration / step)) + 1)
    found: list[Channel] = []
    for cable, series in recording.tension.items():
        found += _channels(rig, grid, cable, "tension", "N", series, slice(0, 1))
    if recording.imu is not None and rig.imu is not None:
        found += _channels(rig, grid, "imu", "angular_rate", "rad/s", recording.imu, slice(0, 3))
        found += _channels(rig, grid, "imu", "specific_force", "m/s^2", recording.imu, slice(3, 6))
    if recording.inclination is not None and rig.inclinometer is not None:
        found += _channels(
            rig, grid, "inclinometer", "inclination", "rad", recording.inclination, slice(0, 2)
        )
    mean = None
    if recording.mocap is not None:
        series, mean = _mocap_series(recording.mocap)
        found += _channels(rig, grid, "mocap", "position", "m", series, slice(0, 3))
        found += _channels(rig, grid, "mocap", "orientation", "rad", series, slice(3, 6))
    exciter = recording.exciter_force if rig.exciter is not None else None
    noise, rate, force = 0.0, 1.0, None
    unknown: tuple[tuple[float, float], ...] = ()
    if exciter is not None and exciter.time.size > 8:
        std, _ = noise_std(rig, "exciter_force", exciter.time, exciter.values)
        noise = float(np.sqrt(np.mean(std**2)))
        rate = 1.0 / float(np.median(np.diff(exciter.time)))
        known = bridged(grid, exciter.time, exciter.values, noise)
        unknown = known.unknown
        force = replace(node_input(grid, known.time, known.values, noise), doubt=known.variance)
        if not (unknown or np.any(force.doubt) or np.any(force.jumps)):
            force = smooth_force(grid, exciter.time, exciter.values, std) or force
    channels = tuple(found)
    run = Run(recording, grid, channels, force, noise, rate, mean, unknown=unknown)
    if not run.watched:
        run = replace(run, R_tracker_mean=None)
    if force is None or force.cutoff > 0.0:
        return run
    felt = noise_felt(grid, known.time, run.samplers)
    return replace(run, channels=tuple(replace(c, felt=f) for c, f in zip(channels, felt, strict=True)))
