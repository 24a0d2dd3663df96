"""Where a tracker's marker sits and how the room lies in its frame, from the cables' lengths and their pull.

A cable of length l between c in the room and p on the body has |x + R p - c| = l at every pose (x, R). A
tracker sees (x, R) through two constant mounts, twelve numbers, and each pose is one equation a cable for
them, without mass or force: the calibration of a parallel robot by the lengths of its legs (Zhuang, Yan and
Masory, Journal of Robotic Systems 15, 1998). Small swings leave some of the twelve to a few degrees. What
the cells measure tells those: with the right mounts, and for one body, momentum balances (momentum.py). Both
are fitted together, with the body, and neither needs a motion that is predicted. A rig that looks alike when
turned has a minimum for each way, so every heading is tried.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.first_guess import extent, headings, seen_pose
from rig_identification.estimate.momentum import balance, regress, spread_of_rows
from rig_identification.estimate.parameters import INERTIAL, ParameterSet
from rig_identification.estimate.prediction import Bench
from rig_identification.estimate.track import Track
from rig_identification.model.body import linear_from_log_cholesky
from rig_identification.model.motion import State
from rig_identification.model.sensors import MocapMount
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Poses whose lengths are looked at: twelve numbers are sought, a pose tells as many as there are cables.
POSES = 100
#: Std (rad) of the turns of marker and room about where a search begins: a belief that decides nothing.
TURN = 1.0
#: World axes in the tracker's frame, as makers of trackers have them: z up, and y up.
UPRIGHT = (np.eye(3), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]))
#: Turns (rad) by which two mounts are two, and how many of those that keep the lengths best are balanced.
APART, BALANCED = 0.1, 4
#: Span (s) of the cubics by which poses become speeds: a tenth of the shortest period of such rigs or two.
SMOOTHED = 0.2
#: Rounds in which momentum is weighed by what the last one left of it, and evaluations of each.
ROUNDS, EVALUATIONS = 3, 20


@dataclass(frozen=True)
class Seen:
    """What a tracker saw, at the nodes of a run, with its speed."""

    time: Array  # (N,) s
    position: Array  # (N, 3) m, tracker frame
    velocity: Array  # (N, 3) m/s, tracker frame
    attitude: Array  # (N, 3, 3) R_tracker_marker
    rate: Array  # (N, 3) rad/s, marker frame

    def track(self, mount: MocapMount) -> Track:
        """The motion of the body for a mount."""
        R = mount.R_tracker_world.T @ self.attitude @ mount.R_body_marker.T
        rate = self.rate @ mount.R_body_marker.T
        arm, about = R @ mount.marker_position, np.cross(rate, mount.marker_position)
        states = np.zeros((self.time.size, 12))
        states[:, :3] = (self.position - mount.world_position) @ mount.R_tracker_world - arm
        states[:, 6:9] = self.velocity @ mount.R_tracker_world - np.einsum("nij,nj->ni", R, about)
        states[:, 9:] = rate
        none = np.zeros((self.time.size, 0))
        return Track(self.time, states, R, none, none, none)


def seen_motion(run: Run) -> Seen | None:
    """The tracker's poses smoothed at the run's nodes; None where it sees less than a pose."""
    pose = seen_pose(run)
    if pose is None or run.R_tracker_mean is None or not np.all(pose.known):
        return None
    step = run.grid.step
    time = np.arange(run.grid.nodes, dtype=np.float64) * step
    window = max(5, round(SMOOTHED / step) | 1)
    if window > time.size:
        return None
    values: Array = np.stack([np.interp(time, pose.time, pose.values[:, k]) for k in range(6)], axis=1)
    smooth: Array = savgol_filter(values, window, 3, axis=0)
    speed: Array = savgol_filter(values, window, 3, deriv=1, delta=step, axis=0)
    attitude: Array = run.R_tracker_mean @ _matrix(smooth[:, 3:])
    turned = Rotation.from_matrix(np.swapaxes(attitude[:-1], 1, 2) @ attitude[1:]).as_rotvec() / step
    rate: Array = np.concatenate([turned[:1], 0.5 * (turned[1:] + turned[:-1]), turned[-1:]])
    return Seen(time, smooth[:, :3], speed[:, :3], attitude, rate)


@dataclass(frozen=True)
class Mounted:
    """A mount, and the body that balances momentum with it."""

    mount: MocapMount
    theta: Array
    cost: float  # negative log likelihood of lengths and momentum, less a constant


def mount_by_lengths(bench: Bench, run: Run, rest: State, theta: Array, weak: Array) -> Mounted | None:
    """The mount with which a run's poses keep the cables' lengths and balance the momentum.

    rest: pose in which the body hangs. theta (p,): guess; weak (10,): std of the belief in the body.
    None where less than a pose is seen, or a cable's tension is not measured.
    """
    seen, rig, parameters = seen_motion(run), bench.rig, bench.of(run).parameters
    if seen is None:
        return None
    if balance(seen.track(_level(run, seen, rest, np.eye(3))), run, parameters, theta) is None:
        return None
    lengths = _Lengths.of(rig, run, seen)
    rooms = [up @ _matrix(np.array([0.0, 0.0, h])) for up in UPRIGHT for h in headings(rig, run)]
    found = sorted(
        (lengths.solved(_level(run, seen, rest, room)) for room in rooms), key=lambda pair: pair[0]
    )
    apart: list[MocapMount] = []
    for _, mount in found:
        if all(_turn(mount, other) > APART for other in apart):
            apart.append(mount)
    every = [_balanced(lengths, mount, run, parameters, theta, weak) for mount in apart[:BALANCED]]
    return min(every, key=lambda one: one.cost)


@dataclass(frozen=True)
class _Lengths:
    """Poses, and the cables whose lengths they have to keep."""

    rig: Rig
    seen: Seen
    some: NDArray[np.int64]
    doubt: float  # m
    prior: Array  # (12,) std of the errors of a first mount

    @classmethod
    def of(cls, rig: Rig, run: Run, seen: Seen) -> _Lengths:
        some = np.unique(np.linspace(0, seen.time.size - 1, POSES).astype(np.int64))
        noise = next(c.noise[:3] for c in run.channels if c.device == "mocap" and 0 in c.components)
        errors = (rig.tolerance["cable_length"], rig.tolerance["hinge_position"], *noise)
        prior = np.repeat([float(np.max(extent(rig))), TURN, float(np.max(extent(rig))), TURN], 3)
        return cls(rig, seen, some, float(np.linalg.norm(errors)), prior)

    def missed(self, mount: MocapMount) -> Array:
        """(n cables,) how far each cable is from its length at each pose, in standard deviations."""
        track = self.seen.track(mount)
        hinge = np.array([cable.body_point for cable in self.rig.cables])
        ceiling = np.array([cable.ceiling_point for cable in self.rig.cables])
        length = np.array([cable.length for cable in self.rig.cables])
        R, x = track.R_world_body[self.some], track.states[self.some, :3]
        to_hinge = x[:, None] + np.einsum("nij,kj->nki", R, hinge) - ceiling
        miss: Array = (np.linalg.norm(to_hinge, axis=2) - length) / self.doubt
        return miss.ravel()

    def solved(self, first: MocapMount) -> tuple[float, MocapMount]:
        """Cost and mount that keeps the lengths best, from a first one."""

        def residuals(errors: Array) -> Array:
            return np.concatenate([self.missed(first.off_by(errors)), errors / self.prior])

        best = least_squares(residuals, np.zeros(12), x_scale="jac", max_nfev=60)
        return float(best.cost), first.off_by(best.x)


def _balanced(
    lengths: _Lengths, first: MocapMount, run: Run, parameters: ParameterSet, theta: Array, weak: Array
) -> Mounted:
    """Mount and body that keep the lengths and balance momentum, from a mount that does the first."""

    def missed(mount: MocapMount, body: Array) -> Array:
        both = balance(lengths.seen.track(mount), run, parameters, theta)
        if both is None:
            raise AssertionError("every tension is measured")
        rows, right = both
        return right - rows @ linear_from_log_cholesky(body)

    guess = theta[:INERTIAL]
    at_first = balance(lengths.seen.track(first), run, parameters, theta)
    assert at_first is not None
    body = regress([at_first], guess, weak)[0]
    x = np.concatenate([np.zeros(12), body])
    scale = np.concatenate([lengths.prior, weak])
    for _ in range(ROUNDS):
        weight = spread_of_rows(missed(first.off_by(x[:12]), x[12:]))

        def residuals(x: Array, weight: Array = weight) -> Array:
            mount = first.off_by(x[:12])
            belief = np.concatenate([x[:12], x[12:] - guess]) / scale
            return np.concatenate([lengths.missed(mount), missed(mount, x[12:]) / weight, belief])

        x = least_squares(residuals, x, x_scale="jac", max_nfev=EVALUATIONS).x
    mount, out = first.off_by(x[:12]), theta.copy()
    out[:INERTIAL] = x[12:]
    left = spread_of_rows(missed(mount, x[12:]))
    cost = 0.5 * float(np.sum(lengths.missed(mount) ** 2)) + float(np.sum(np.log(left)))
    return Mounted(mount, out, cost)


def _level(run: Run, seen: Seen, rest: State, R_tracker_world: Array) -> MocapMount:
    """The mount with which the mean pose is the rest pose, and the marker sits at the datum."""
    R_body_marker = (R_tracker_world @ rest.R_world_body).T @ run.R_tracker_mean
    world = np.mean(seen.position, axis=0) - R_tracker_world @ rest.position
    return MocapMount(np.zeros(3), R_body_marker, world, R_tracker_world)


def _matrix(turn: Array) -> Array:
    R: Array = Rotation.from_rotvec(turn).as_matrix()
    return R


def _turn(one: MocapMount, other: MocapMount) -> float:
    """Turn (rad) from one room to the other."""
    return float(Rotation.from_matrix(one.R_tracker_world.T @ other.R_tracker_world).magnitude())
