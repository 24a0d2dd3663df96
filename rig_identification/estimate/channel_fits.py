"""Every measured sample beside its prediction, for residuals and pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import AXES, Channel, Run, axis_name
from rig_identification.estimate.prediction import Linearised, device_shows, smoothed
from rig_identification.estimate.rest_evidence import RestEvidence, RestLinearised
from rig_identification.estimate.sampling import interpolation
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.unseen import unseen_of
from rig_identification.estimate.unseen_sway import likeliest_sway
from rig_identification.estimate.wander import likeliest_moves, moves_at
from rig_identification.result import BodyMotion, ChannelFit

Array = NDArray[np.float64]


def node_corrections(linearised: Linearised) -> Array | None:
    """(N, 18 + n) correction of the raw outputs by the exciter's smoothed force error; None: no noise."""
    motion = linearised.motion
    if not np.any(linearised.noise.Q) or motion.H is None or motion.D is None:
        return None
    states, wrenches, _ = smoothed(linearised)
    return np.asarray(np.einsum("nij,nj->ni", motion.H, states) + np.einsum("nij,nj->ni", motion.D, wrenches))


def run_fits(problem: Problem, run: Run, linearised: Linearised, theta: Array) -> list[ChannelFit]:
    """One :class:`ChannelFit` an axis of each channel of a run, sample by sample."""
    moved = _moved(problem, run, linearised)
    corrections = node_corrections(_beside(run, linearised, moved))
    parameters = problem.bench.of(run).parameters
    places, own = parameters.places, parameters.device(theta)
    fits = []
    off = _likeliest(problem, run, linearised)
    for index, channel in enumerate(run.channels):
        reading = linearised.readings[channel.device]
        nodes = reading.values[:, channel.columns]
        if corrections is not None:
            nodes = nodes + np.einsum("nij,nj->ni", reading.in_raw[:, channel.columns], corrections)
        nodes = device_shows(run.grid.step, channel, own, places, nodes)
        beside, itself = off.get(index, (0.0, 0.0))
        late = own[places.clock(channel.device)]
        each = np.arange(channel.time.size)
        value, _ = interpolation(run.grid, channel.time - late, each, channel.time.size)
        predicted = np.asarray(value @ (nodes + beside)) + itself
        if index in moved:
            predicted = predicted + moves_at(run, channel.time) @ moved[index].T
        fits += _axes(run.recording.name, channel, predicted, run.offset)
    return fits


def _likeliest(problem: Problem, run: Run, linearised: Linearised) -> dict[int, tuple[Array, Array]]:
    """By channel the likeliest of what its samples are off by: (N, w) at the nodes, (n, w) at the samples."""
    out: dict[int, tuple[Array, Array]] = {}
    if np.any(linearised.noise.Q):
        # Where a random wrench whitens the residuals nothing else is integrated out of them
        return out
    which, axis, variance = linearised.channel, linearised.axis, linearised.variance
    for off in unseen_of(problem.bench.rig, problem.bench.unseen, run, which, axis, variance):
        left = linearised.plain[off.rows] / np.sqrt(variance[off.rows])
        amounts = likeliest_sway(off.seen, left)
        width, first = run.channels[off.channel].width, off.at_nodes.shape[1]
        empty = (np.zeros((run.grid.nodes, width)), np.zeros((off.at_samples.shape[0], width)))
        beside, itself = out.setdefault(off.channel, empty)
        beside[:, off.column] = off.at_nodes @ amounts[:first]
        itself[:, off.column] = off.at_samples @ amounts[first:]
    return out


def _moved(problem: Problem, run: Run, linearised: Linearised) -> dict[int, Array]:
    """(w, MOVES) by channel how its zeros moved, where they are freed; what every device's do is noise."""
    bench = problem.bench
    if bench.freed is None:
        return {}
    stds = [bench.wander_of(c.quantity) for c in run.channels]
    moves = likeliest_moves(run, linearised.wander, linearised.residual, stds)
    return {i: m for i, m in moves.items() if run.channels[i].quantity == bench.freed}


def _beside(run: Run, linearised: Linearised, moved: dict[int, Array]) -> Linearised:
    """The run with its residuals beside zeros that ``moved``: a force that follows them is none."""
    if not moved:
        return linearised
    plain = linearised.plain.copy()
    for index, moves in moved.items():
        for axis, own in zip(run.channels[index].axes, moves, strict=True):
            rows = (linearised.channel == index) & (linearised.axis == axis)
            plain[rows] -= moves_at(run, run.grid.step * linearised.nodes[rows]) @ own
    return replace(linearised, plain=plain)


#: Hz. Smoother than a film; the slowest swing of a rig has many frames still.
FRAMES = 25.0


def run_motion(run: Run, linearised: Linearised) -> BodyMotion:
    """The body's way in a run as the model moves, for a drawing; the exciter's force error is not in it."""
    motion, step = linearised.motion, run.grid.step
    nodes = np.arange(0, motion.nodes, max(1, round(1.0 / (FRAMES * step))))
    turns = Rotation.from_matrix(motion.R_world_body[nodes])
    place = motion.states[nodes, :3]
    return BodyMotion(run.recording.name, np.asarray(run.offset + step * nodes), place, turns.as_quat())


def _axes(recording: str, channel: Channel, predicted: Array, offset: float) -> list[ChannelFit]:
    return [
        ChannelFit(
            recording,
            channel.device,
            channel.quantity,
            channel.axis_name(axis),
            channel.unit,
            float(channel.noise[k]),
            channel.noise_estimated,
            channel.time + offset,
            channel.values[:, k],
            predicted[:, k],
        )
        for k, axis in enumerate(channel.axes)
    ]


def rest_fits(evidence: RestEvidence, rest: RestLinearised) -> list[ChannelFit]:
    """One point a channel and axis of a static recording: its mean, in units of the mean's own std."""
    fits = []
    middle = np.array([0.5 * evidence.recording.duration])
    for channel, predicted in zip(evidence.channels, rest.predicted, strict=True):
        for a, component in enumerate(channel.components):
            fits.append(
                ChannelFit(
                    evidence.recording.name,
                    channel.device,
                    channel.quantity,
                    axis_name(channel.quantity, component % AXES),
                    channel.unit,
                    float(np.sqrt(channel.variance[a])),
                    False,
                    middle,
                    channel.mean[a : a + 1],
                    predicted[a : a + 1],
                )
            )
    return fits
