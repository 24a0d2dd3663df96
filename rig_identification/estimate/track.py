"""Motion of the body from its sensors and the cables' geometry, without trusting its inertia.

An extended Kalman filter on the forward model: a random wrench stands for everything that
the assumed body gets wrong, and the model is linearised afresh in blocks short enough for
the error inside a block to stay small. Each block is smoothed. Cable lengths hold exactly
and gravity is seen by accelerometer and inclinometer, so that nothing drifts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.prediction import Bench, Linearised, linearise_run, model_at, smoothed
from rig_identification.model import layout
from rig_identification.model.motion import State, on_cables

Array = NDArray[np.float64]

#: Length of a block (s): a tenth of the shortest rigid-body period of vehicle rigs.
BLOCK = 0.1
#: Time (s) over which a reading's mean is believed as far as rig and device are: a swing of such rigs.
SETTLING = 1.0

Row = tuple[int, int]  # index into run.channels, column within the channel


@dataclass(frozen=True)
class Track:
    """Smoothed motion at the nodes of a run."""

    time: Array  # (N,) s
    states: Array  # (N, 12) position and velocity in world, rate in body; rotation entries are zero
    R_world_body: Array  # (N, 3, 3)
    covariance: Array  # (N, 12, 12) of the filtered state
    wrench: Array  # (N, 6) what the assumed body's equations lack, about the datum, body axes
    outputs: Array  # (N, 18 + n) raw outputs of the forward model, corrected

    def state(self, node: int) -> State:
        """State at one node."""
        x = self.states[node]
        return State(x[:3], self.R_world_body[node], x[6:9], x[9:12])


def wrench_noise(mass: float, gravity: float, size: float, step: float, share: float) -> Array:
    """(6, 6) covariance of a random wrench of ``share`` of the body's weight, white from block to block."""
    force = (share * mass * gravity) ** 2 * (BLOCK / step)
    return np.diag([force] * 3 + [force * size**2] * 3)


def start_covariance(spread: float = 0.05, speed: float = 0.2) -> Array:
    """(12, 12) covariance of a start state known to ``spread`` m and rad and ``speed`` m/s and rad/s."""
    return np.diag([spread**2] * 6 + [speed**2] * 6)


def smoothed_from(linearised: Linearised, spread: float, speed: float) -> tuple[Array, Array]:
    """(N, X) state and (N, 6) wrench corrections of a run that starts about where it is known to.

    spread, speed: see :func:`start_covariance`; what swings inside begins where the model has it.
    """
    P = np.zeros((linearised.motion.states.shape[1],) * 2)
    P[:12, :12] = start_covariance(spread, speed)
    states, wrenches, _ = smoothed(linearised, P)
    return states, wrenches


def doubted_variance(bench: Bench, run: Run, theta: Array, start: State, doubted: float) -> dict[Row, float]:
    """Variance of each reading for what rig and devices may be off by, as if it were noise.

    Such an error is constant, and a filter would believe it to be averaged away. It is given the variance
    with which the mean of :data:`SETTLING` seconds is as uncertain as the error itself. doubted: its std in
    tolerances. The sensitivities are those of the first second about ``start``.
    """
    if doubted == 0.0:
        return {}
    early = run.until(SETTLING)
    lin = linearise_run(bench, early, theta, start)
    if lin is None:
        return {}
    doubts = lin.jacobian[:, INERTIAL : bench.parameters.size]
    each = doubted**2 * np.sum(doubts**2, axis=1) * lin.variance
    out = {}
    for channel in np.unique(lin.channel):
        for axis in np.unique(lin.axis[lin.channel == channel]):
            rows = (lin.channel == channel) & (lin.axis == axis)
            rate = np.count_nonzero(rows) / max(early.grid.duration, early.grid.step)
            out[int(channel), int(axis)] = float(np.mean(each[rows])) * max(1.0, rate * SETTLING)
    return out


def _doubting(lin: Linearised, more: dict[Row, float]) -> Linearised:
    """The same with the variance of each row enlarged."""
    if not more:
        return lin
    added = [more.get((int(c), int(a)), 0.0) for c, a in zip(lin.channel, lin.axis, strict=True)]
    return replace(lin, variance=lin.variance + np.array(added))


def track(
    bench: Bench,
    run: Run,
    theta: Array,
    start: State,
    start_spread: Array,
    noise: Array,
    doubted: float = 0.0,
) -> Track | None:
    """Track a run from ``start``; None where the motion cannot be followed.

    start_spread (12, 12): covariance of the start. noise (6, 6): covariance of the random
    wrench over one node interval (:func:`wrench_noise`). doubted: see :func:`doubted_variance`.
    """
    bench = bench.of(run)
    more = doubted_variance(bench, run, theta, start, doubted)
    model = model_at(bench.parameters, theta)
    nodes = run.grid.nodes
    block = max(8, round(BLOCK / run.grid.step))
    states, rotations = np.zeros((nodes, 12)), np.zeros((nodes, 3, 3))
    covariance, wrenches = np.zeros((nodes, 12, 12)), np.zeros((nodes, 6))
    outputs = np.zeros((nodes, layout.OUT_TENSION + model.cables))
    state, P = start, start_spread
    first = 0
    while first < nodes - 1:
        last = min(first + block, nodes - 1)
        if nodes - 1 - last < block:
            last = nodes - 1
        part = run.between(first, last)
        lin = linearise_run(bench, part, theta, state, start_only=True, extra_noise=noise)
        if lin is None:
            return None
        lin = _doubting(lin, more)
        corrections, wrench, filtered = smoothed(lin, P)
        if not np.all(np.isfinite(corrections)):
            return None
        for k in range(last - first + 1):
            moved = lin.motion.state(k).moved(corrections[k])
            node = first + k
            states[node] = moved.vector()
            rotations[node] = moved.R_world_body
        here = slice(first, last + 1)
        covariance[here], wrenches[here] = filtered, wrench
        _, _, H, D, _ = lin.motion.derivatives
        change = np.einsum("nij,nj->ni", H, corrections) + np.einsum("nij,nj->ni", D, wrench)
        outputs[here] = lin.motion.outputs + change
        # The last node's rows were used in this block: hand over one node earlier
        x = states[last]
        state = on_cables(model, State(x[:3], rotations[last], x[6:9], x[9:12]))
        P = filtered[-1]
        first = last
    time = np.asarray(run.grid.step * np.arange(nodes), dtype=np.float64)
    return Track(time, states, rotations, covariance, wrenches, outputs)
