"""Pose and velocity of the body at IMU rate, with covariance, while the samples come in."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.estimate.first_guess import first_elements, rest_of
from rig_identification.live import strapdown
from rig_identification.model.motion import rig_model
from rig_identification.model.so3 import skew
from rig_identification.recording import Session
from rig_identification.rig import Rig

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

#: Noise where the description is silent: a tactical IMU's.
DEFAULT_NOISE = {"specific_force": 0.02, "angular_rate": 0.0005, "inclination": 0.0005}
#: Random walks of gyroscope rad/s and accelerometer m/s^2 bias, per square root second.
BIAS_WALK = (2e-6, 2e-5)
#: The cables' lengths are used so often, s, and each time trusted to so much, m and m/s.
CABLE_PERIOD = 0.005
CABLE_STD, CABLE_SPEED_STD = 0.002, 0.004
#: A start known to so much: m, rad, m/s.
START_SPREAD = (0.3, 0.2, 0.3)
#: Cable lengths are trusted less while the start is still being found, s and factor.
SETTLING, SETTLING_FACTOR = 1.0, 20.0
#: Direction of pull: used so often, s, and trusted to so much, rad (lever arms of rotation are neglected).
PULL_PERIOD, PULL_STD = 0.02, 0.02
#: Samples of another device this far from the IMU's, s, are not used.
APART = 0.05
#: An interval between IMU samples longer than this, s, starts the tracker anew.
LONGEST_GAP = 0.5
#: What a scale error of the reading adds to an inclination's noise, rad.
_INCLINATION_FLOOR = 2e-4


@dataclass(frozen=True)
class Tracked:
    """The body at the stamps of IMU samples."""

    stamp_ns: Stamps  # (n,)
    pose: Array  # (n, 7) position of the datum in world m, quaternion xyzw of body in world
    pose_covariance: Array  # (n, 6, 6) position (world), rotation (world axes)
    twist: Array  # (n, 6) velocity of the datum m/s, angular rate rad/s, body axes
    twist_covariance: Array  # (n, 6, 6)


class BodyTracker:
    """Strapdown integration, held by cable lengths, inclinometer and the cables' pull.

    Parameters
    ----------
    rig : Rig
        With an IMU.
    integrate_only : bool
        Plain integration from rest: no measurement but the IMU's.

    Raises
    ------
    InputError
        The rig has no IMU.
    """

    def __init__(self, rig: Rig, integrate_only: bool = False) -> None:
        if rig.imu is None:
            raise InputError("the rig description has no imu: the tracker needs its position and orientation")
        self._rig, self._integrate_only = rig, integrate_only
        self._r = np.asarray(rig.imu.position, dtype=float)
        self._arm = skew(self._r)
        self._R_body_imu = Rotation.from_quat(rig.imu.orientation).as_matrix()
        self._ceiling = np.array([cable.ceiling_point for cable in rig.cables])
        self._arms = np.array([cable.body_point for cable in rig.cables]) - self._r
        self._lengths = np.array([cable.length for cable in rig.cables])
        noise = {**DEFAULT_NOISE, **rig.noise}
        self._noise = np.array([noise["angular_rate"], noise["specific_force"], *BIAS_WALK])
        self._inclination_std = float(np.hypot(noise["inclination"], _INCLINATION_FLOOR))
        self._axes = np.zeros((2, 3))
        if rig.inclinometer is not None:
            self._axes = Rotation.from_quat(rig.inclinometer.orientation).as_matrix()[:, :2].T.copy()
        self._turn_exciter = np.eye(3)
        if rig.exciter is not None:
            self._turn_exciter = Rotation.from_quat(rig.exciter.orientation).as_matrix()
        elements = first_elements(Session("live", rig, ()))
        self._rest = rest_of(rig_model(rig, elements))
        self._center = elements[1:4] - self._r
        self._inclinations: deque[tuple[int, Array]] = deque(maxlen=200)
        self._tension = np.full(len(rig.cables), np.nan)
        self._tension_ns = np.zeros(len(rig.cables), np.int64)
        self._applied = np.zeros(3)
        self._names = [cable.name for cable in rig.cables]
        self.restarts = 0
        self._begin(0)

    def _begin(self, stamp_ns: int) -> None:
        """Start at rest, knowing little."""
        R = self._rest.R_world_body
        self._p = self._rest.position + R @ self._r
        self._R = np.array(R, order="C")
        self._v, self._bias = np.zeros(3), np.zeros(6)
        tolerance = self._rig.tolerance
        place, turn, speed = START_SPREAD if not self._integrate_only else (0.001, 0.001, 0.001)
        std = np.repeat([place, turn, speed, tolerance["gyroscope_bias"], tolerance["accelerometer_bias"]], 3)
        self._P = np.diag(std**2)
        self._begun_ns = self._last_ns = stamp_ns
        self._cables_due = self._pull_due = stamp_ns
        self._rate, self._force = np.zeros(3), np.zeros(3)

    def add_inclination(self, stamp_ns: Stamps, values: Array) -> None:
        """(n, 2) rad."""
        self._inclinations.extend(zip(stamp_ns.tolist(), np.sin(values), strict=True))

    def add_tension(self, cable: str, stamp_ns: Stamps, values: Array) -> None:
        """(n, 1) N; the mean of a batch stands for it."""
        if len(stamp_ns):
            i = self._names.index(cable)
            self._tension[i], self._tension_ns[i] = float(np.mean(values)), stamp_ns[-1]

    def add_exciter(self, values: Array) -> None:
        """(n, 3) N, exciter frame."""
        if len(values):
            self._applied = self._turn_exciter @ np.mean(values, axis=0)

    def add_imu(self, stamp_ns: Stamps, values: Array) -> Tracked:
        """Advance through samples (n, 6) with ascending stamps; returns the body at each."""
        n = len(stamp_ns)
        pose, twist = np.zeros((n, 7)), np.zeros((n, 6))
        R_all, P_all = np.zeros((n, 3, 3)), np.zeros((n, strapdown.ERRORS, strapdown.ERRORS))
        rate_all = values[:, :3] @ self._R_body_imu.T
        force_all = values[:, 3:] @ self._R_body_imu.T
        for k in range(n):
            self._advance(int(stamp_ns[k]), rate_all[k], force_all[k])
            w = rate_all[k] - self._bias[:3]
            pose[k, :3] = self._p - self._R @ self._r
            twist[k, :3] = self._v @ self._R + self._arm @ w  # w x r = -r x w
            twist[k, 3:] = w
            R_all[k], P_all[k] = self._R, self._P
        if n:
            pose[:, 3:] = Rotation.from_matrix(R_all).as_quat()
        return Tracked(
            stamp_ns, pose, self._pose_covariance(R_all, P_all), twist, self._twist_covariance(R_all, P_all)
        )

    def _advance(self, stamp_ns: int, rate: Array, force: Array) -> None:
        dt = (stamp_ns - self._last_ns) / 1e9
        if self._last_ns == 0 or not 0.0 < dt < LONGEST_GAP:
            self.restarts += self._last_ns != 0
            self._begin(stamp_ns)
            self._rate, self._force = rate, force
            return
        mean_rate, mean_force = 0.5 * (rate + self._rate), 0.5 * (force + self._force)
        state = (self._p, self._R, self._v, self._bias, self._P)
        strapdown.propagate_sample(*state, mean_rate, mean_force, dt, self._rig.gravity, self._noise)
        self._last_ns, self._rate, self._force = stamp_ns, rate, force
        if not self._integrate_only:
            self._hold(stamp_ns, rate, force)

    def _hold(self, stamp_ns: int, rate: Array, force: Array) -> None:
        state = (self._p, self._R, self._v, self._bias, self._P)
        if stamp_ns >= self._cables_due:
            self._cables_due = stamp_ns + round(1e9 * CABLE_PERIOD)
            left = max(0.0, 1.0 - (stamp_ns - self._begun_ns) / (1e9 * SETTLING))
            factor = SETTLING_FACTOR**left
            strapdown.update_cables(
                *state,
                rate,
                self._ceiling,
                self._arms,
                self._lengths,
                CABLE_STD * factor,
                CABLE_SPEED_STD * factor,
            )
        while self._inclinations and self._inclinations[0][0] <= stamp_ns:
            measured_ns, sines = self._inclinations.popleft()
            ago = (stamp_ns - measured_ns) / 1e9
            if ago < APART:
                # du/dt = -w x u: carry the reading to the present
                up = self._R[2]
                moved = sines + self._axes @ (-ago * np.cross(rate - self._bias[:3], up))
                strapdown.update_axes_up(*state, self._axes, moved, self._inclination_std)
        fresh = np.all(np.abs(self._tension_ns - stamp_ns) < 1e9 * APART) and np.all(
            np.isfinite(self._tension)
        )
        if stamp_ns >= self._pull_due and fresh:
            self._pull_due = stamp_ns + round(1e9 * PULL_PERIOD)
            w = rate - self._bias[:3]
            at_center = force + np.cross(w, np.cross(w, self._center))
            strapdown.update_pull(
                *state, at_center, self._tension, self._applied, self._ceiling, self._arms, PULL_STD
            )

    def _pose_covariance(self, R: Array, P: Array) -> Array:
        """(n, 6, 6) of the datum; what the lab believes of lengths does not average out."""
        J = np.zeros((len(R), 6, strapdown.ERRORS))
        J[:, :3, 0:3] = np.eye(3)
        J[:, :3, 3:6] = R @ self._arm
        J[:, 3:, 3:6] = R
        out = J @ P @ J.transpose(0, 2, 1)
        tolerance = self._rig.tolerance
        floor = tolerance["cable_length"] ** 2 + tolerance["hinge_position"] ** 2
        out[:, np.arange(3), np.arange(3)] += floor
        out[:, np.arange(3, 6), np.arange(3, 6)] += tolerance["level"] ** 2
        return np.asarray(out)

    def _twist_covariance(self, R: Array, P: Array) -> Array:
        J = np.zeros((len(R), 6, strapdown.ERRORS))
        Rt = R.transpose(0, 2, 1)
        J[:, :3, 6:9] = Rt
        J[:, :3, 3:6] = skew(np.einsum("nij,j->ni", Rt, self._v))
        J[:, :3, 9:12] = -self._arm
        J[:, 3:, 9:12] = -np.eye(3)
        out = J @ P @ J.transpose(0, 2, 1)
        out[:, np.arange(3, 6), np.arange(3, 6)] += self._noise[0] ** 2
        return np.asarray(out)
