"""Chapter 3's pose from gyroscope and accelerometer alone, beside a tracker that the cables and gravity hold.

Both see one simulated session of a rig as described, with the noise of good industrial sensors.
Integration starts from the true pose and velocity, which no lab knows; the tracker starts from
rest and geometry and takes its body from the momentum regression (estimate/launch.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.launch import SHARE, Launch, launch_state
from rig_identification.estimate.prediction import model_at, start_basis
from rig_identification.estimate.track import BLOCK, Track, start_covariance, track, wrench_noise
from rig_identification.model.motion import RigModel, State
from rig_identification.recording import Recording, Series, Session
from rig_identification.simulate import case_spec, simulate_session
from rig_identification.thesis.case import Case
from rig_identification.thesis_rerun.integration import integrate

Array = NDArray[np.float64]

#: Compared so often, s.
EVERY = 0.1
#: What the launch's start is trusted to (m and rad; m/s and rad/s), and the motion that betters it, s.
START_SPREAD, BETTERED = (0.1, 0.2), 2.0


@dataclass(frozen=True)
class PoseError:
    """Error of a tracked pose over time."""

    time: Array  # (k,) s
    position: Array  # (k,) m
    attitude: Array  # (k,) rad

    @property
    def position_rms(self) -> float:
        """m."""
        return float(np.sqrt(np.mean(self.position**2)))

    @property
    def attitude_rms(self) -> float:
        """rad."""
        return float(np.sqrt(np.mean(self.attitude**2)))


@dataclass(frozen=True)
class TrackingComparison:
    """Both on the same recording."""

    case: str
    duration: float  # s
    held: PoseError
    integrated: PoseError
    freedom: int  # of the state that the cables leave
    nees: float  # mean of e^T P^-1 e / freedom: 1 is consistent
    within_95: float  # share of instants at which it lies below chi-square's 95 % point


@dataclass(frozen=True)
class _Truth:
    """The recorded ground truth at any time."""

    position: CubicSpline
    quaternion: CubicSpline
    velocity: CubicSpline  # world
    rate: CubicSpline  # body

    @classmethod
    def of(cls, series: Series) -> _Truth:
        v = series.values
        quaternion = v[:, 3:7].copy()
        turned = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0.0
        quaternion[1:][np.cumsum(turned) % 2 == 1] *= -1.0
        velocity = Rotation.from_quat(quaternion).apply(v[:, 7:10])
        parts = (v[:, :3], quaternion, velocity, v[:, 10:13])
        return cls(*(CubicSpline(series.time, part) for part in parts))

    def turn(self, time: Array) -> Rotation:
        return Rotation.from_quat(self.quaternion(time))


def compare_tracking(case: Case, duration: float, seed: int) -> TrackingComparison | None:
    """Track one case over ``duration`` s both ways; None where the tracker cannot follow."""
    spec = case_spec(case, duration=duration, holdout=False, doubts=False, rods=True)
    session, _ = simulate_session(spec, np.random.default_rng(seed))
    found = _tracked(session)
    if found is None:
        return None
    track, model = found
    recording = session.training[0]
    if recording.ground_truth is None:
        raise AssertionError("the simulator records the true pose")
    truth = _Truth.of(recording.ground_truth)
    step = float(track.time[1])
    # One node before a block's end: all but its last node's samples have been used, as in the covariance
    nodes = np.arange(round(BLOCK / step) - 1, track.time.size - round(BLOCK / step), round(EVERY / step))
    held, nees, freedom = _held_error(track, model, truth, nodes)
    within = float(np.mean(nees < chi2.ppf(0.95, freedom)))
    return TrackingComparison(
        case.label,
        duration,
        held,
        _integrated_error(session, recording, truth),
        freedom,
        float(np.mean(nees)) / freedom,
        within,
    )


def _tracked(session: Session) -> tuple[Track, RigModel] | None:
    """Motion by the project's tracker, whose body and start are its own guesses, on rods as in the thesis."""
    problem, theta, _ = pose_problem(session)
    parameters = problem.bench.parameters
    rods = replace(parameters.model, can_slacken=np.zeros(parameters.model.cables, dtype=bool))
    bench = replace(problem.bench, parameters=replace(parameters, model=rods))
    launch = Launch(replace(problem, bench=bench), theta).from_rest().from_momentum()
    run = problem.runs[0]
    if launch.rest is None:
        return None
    mass = bench.parameters.elements(launch.theta)[0]
    size = float(np.max(extent(session.rig)))
    noise = wrench_noise(float(mass), session.rig.gravity, size, run.grid.step, SHARE)
    start = launch_state(bench, run, launch.theta, launch.rest, noise)
    spread = start_covariance(*START_SPREAD)
    for _ in range(2):
        # Smoothed over its first block the start is far better than the launch's: linearise about that
        early = track(bench, run.until(BETTERED), launch.theta, start, spread, noise)
        if early is None:
            return None
        start = early.state(0)
    found = track(bench, run, launch.theta, start, spread, noise)
    return None if found is None else (found, model_at(bench.parameters, launch.theta))


def _held_error(
    track: Track, model: RigModel, truth: _Truth, nodes: NDArray[np.int64]
) -> tuple[PoseError, Array, int]:
    """Pose error, normalised squared error of the state at ``nodes``, and the state's freedom."""
    time = track.time[nodes]
    true_turn = truth.turn(time)
    offset = np.zeros((time.size, 12))
    offset[:, :3] = truth.position(time) - track.states[nodes, :3]
    offset[:, 3:6] = (Rotation.from_matrix(track.R_world_body[nodes]).inv() * true_turn).as_rotvec()
    offset[:, 6:9] = truth.velocity(time) - track.states[nodes, 6:9]
    offset[:, 9:12] = truth.rate(time) - track.states[nodes, 9:12]
    nees, freedom = np.zeros(time.size), 0
    for k, node in enumerate(nodes):
        x = track.states[node]
        basis = start_basis(model, State(x[:3], track.R_world_body[node], x[6:9], x[9:12]))
        freedom = basis.shape[1]
        coordinates = np.linalg.pinv(basis)
        spread = coordinates @ track.covariance[node] @ coordinates.T
        own = coordinates @ offset[k]
        nees[k] = own @ np.linalg.solve(spread, own)
    pose = PoseError(time, np.linalg.norm(offset[:, :3], axis=1), np.linalg.norm(offset[:, 3:6], axis=1))
    return pose, nees, freedom


def _integrated_error(session: Session, recording: Recording, truth: _Truth) -> PoseError:
    """The same pose by integration alone from the true start."""
    rig, imu = session.rig, recording.imu
    if imu is None or rig.imu is None:
        raise AssertionError("the case studies mount an IMU")
    turn_imu = Rotation.from_quat(rig.imu.orientation).as_matrix()
    rate, force = imu.values[:, :3] @ turn_imu.T, imu.values[:, 3:] @ turn_imu.T
    begin = int(np.searchsorted(imu.time, truth.position.x[0] + 1e-9))
    first = imu.time[begin : begin + 1]
    R = truth.turn(first).as_matrix()[0]
    arm = np.asarray(rig.imu.position, dtype=float)
    velocity = truth.velocity(first)[0] + R @ np.cross(truth.rate(first)[0], arm)
    start = (truth.position(first)[0] + R @ arm, R, velocity)
    last = int(np.searchsorted(imu.time, truth.position.x[-1]))
    here = slice(begin, last)
    p, turns = integrate(imu.time[here], rate[here], force[here], start, rig.gravity)
    every = max(1, round(EVERY / float(np.median(np.diff(imu.time)))))
    compared = slice(every, None, every)
    time, p, turns = imu.time[here][compared], p[compared], turns[compared]
    position = np.linalg.norm(truth.position(time) - (p - turns @ arm), axis=1)
    attitude = (Rotation.from_matrix(turns).inv() * truth.turn(time)).magnitude()
    return PoseError(time, position, attitude)
