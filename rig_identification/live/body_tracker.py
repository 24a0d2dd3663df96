"""Pose and velocity of the body at IMU rate, with covariance, while the samples come in."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.estimate.first_guess import first_elements, rest_of
from rig_identification.live import strapdown, tracked
from rig_identification.live.imu_history import ImuHistory
from rig_identification.live.tracked import Tracked
from rig_identification.live.trust import Trust
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
#: Tensions this far from the IMU's samples, s, are not used.
APART = 0.05
#: Inclinations that come later than this, s, are not used; until then the body's turn since is taken off.
LATEST = 0.5
#: An interval between IMU samples longer than this, s, starts the tracker anew.
LONGEST_GAP = 0.5
#: One longer than so many usual ones is a hole, walked through in steps of this, s.
HOLE, STEP = 4.0, 0.01
#: What a scale error of the reading adds to an inclination's noise, rad.
_INCLINATION_FLOOR = 2e-4


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
        self._applied, self._applied_ns = np.zeros(3), 0  # 0: there is no exciter that measures
        self._names = [cable.name for cable in rig.cables]
        self._history = ImuHistory()
        self._cables = Trust(2 * len(rig.cables))
        self._level = Trust(2)
        self.restarts = 0
        self.surprises = 0  # times that the measurements contradicted the state, and it was doubted
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
        self._loose = SETTLING_FACTOR
        self._cables.begin(stamp_ns)
        self._level.begin(stamp_ns)
        self._history.clear()
        self._unbroken_ns = stamp_ns  # since then no hole
        self._cables_due = self._pull_due = stamp_ns
        self._rate, self._force = np.zeros(3), np.zeros(3)

    def add_inclination(self, stamp_ns: Stamps, values: Array) -> None:
        """(n, 2) rad."""
        self._inclinations.extend(zip(stamp_ns.tolist(), np.sin(values), strict=True))

    def add_tension(self, cable: str, stamp_ns: Stamps, values: Array) -> None:
        """(n, 1) N; the mean of a batch's last moment stands for it: batches grow on a busy machine."""
        if len(stamp_ns):
            i = self._names.index(cable)
            self._tension[i], self._tension_ns[i] = _latest(stamp_ns, values)[0], stamp_ns[-1]

    def add_exciter(self, stamp_ns: Stamps, values: Array) -> None:
        """(n, 3) N, exciter frame."""
        if len(stamp_ns):
            self._applied, self._applied_ns = (
                self._turn_exciter @ _latest(stamp_ns, values),
                int(stamp_ns[-1]),
            )

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
        pose_covariance = tracked.pose_covariance(R_all, P_all, self._arm, self._rig.tolerance)
        twist_covariance = tracked.twist_covariance(R_all, P_all, self._arm, self._v, self._noise[0])
        return Tracked(stamp_ns, pose, pose_covariance, twist, twist_covariance)

    def _advance(self, stamp_ns: int, rate: Array, force: Array) -> None:
        dt = (stamp_ns - self._last_ns) / 1e9
        unusual = dt > HOLE * self._history.interval
        hidden = self._history.hidden_in(dt) if unusual and dt < LONGEST_GAP else None
        if self._last_ns == 0 or not 0.0 < dt < LONGEST_GAP or (unusual and hidden is None):
            self.restarts += self._last_ns != 0
            self._begin(stamp_ns)
        elif hidden is None:
            self._propagate(0.5 * (rate + self._rate), 0.5 * (force + self._force), dt, self._noise)
        else:
            self._cross(rate, force, dt, hidden)
            self._unbroken_ns = stamp_ns
        self._last_ns, self._rate, self._force = stamp_ns, rate, force
        self._history.add(stamp_ns, rate, force)
        if not self._integrate_only and stamp_ns > self._begun_ns:
            self._hold(stamp_ns, rate, force)

    def _propagate(self, rate: Array, force: Array, dt: float, noise: Array) -> None:
        state = (self._p, self._R, self._v, self._bias, self._P)
        strapdown.propagate_sample(*state, rate, force, dt, self._rig.gravity, noise)

    def _cross(self, rate: Array, force: Array, dt: float, hidden: Array) -> None:
        """Through a hole in the samples, along a straight line from its one end to the other."""
        steps = max(1, round(dt / STEP))
        noise = self._noise.copy()
        # Independent in each step, they add up to what the hole may hide in all
        noise[0] = np.hypot(noise[0], np.max(hidden[:3])) * np.sqrt(steps)
        noise[1] = np.hypot(noise[1], np.max(hidden[3:])) * np.sqrt(steps)
        for k in range(steps):
            u = (k + 0.5) / steps
            between = ((1.0 - u) * self._rate + u * rate, (1.0 - u) * self._force + u * force)
            self._propagate(*between, dt / steps, noise)

    def _hold(self, stamp_ns: int, rate: Array, force: Array) -> None:
        state = (self._p, self._R, self._v, self._bias, self._P)
        if stamp_ns >= self._cables_due:
            self._cables_due = stamp_ns + round(1e9 * CABLE_PERIOD)
            self._believe(self._cables, stamp_ns, self._cable_update(stamp_ns, rate))
        while self._inclinations and self._inclinations[0][0] <= stamp_ns:
            measured_ns, sines = self._inclinations.popleft()
            if measured_ns >= max(self._unbroken_ns, stamp_ns - round(1e9 * LATEST)):
                self._believe(self._level, measured_ns, self._inclination_update(measured_ns, sines))
        if stamp_ns >= self._pull_due and self._knows_forces(stamp_ns):
            self._pull_due = stamp_ns + round(1e9 * PULL_PERIOD)
            w = rate - self._bias[:3]
            at_center = force + np.cross(w, np.cross(w, self._center))
            strapdown.update_pull(
                *state, at_center, self._tension, self._applied, self._ceiling, self._arms, PULL_STD
            )

    def _knows_forces(self, stamp_ns: int) -> bool:
        """Whether all that pulls was measured just now; a silent exciter leaves its force unknown."""
        stamps = self._tension_ns if self._applied_ns == 0 else np.append(self._tension_ns, self._applied_ns)
        known = np.all(np.isfinite(self._tension)) and np.all(np.abs(stamps - stamp_ns) < 1e9 * APART)
        return bool(known)

    def _cable_update(self, stamp_ns: int, rate: Array) -> Callable[[float], float]:
        left = max(0.0, 1.0 - (stamp_ns - self._begun_ns) / (1e9 * SETTLING))
        factor = self._loose**left

        def update(limit: float) -> float:
            return float(
                strapdown.update_cables(
                    self._p, self._R, self._v, self._bias, self._P, rate, self._ceiling, self._arms,
                    self._lengths, CABLE_STD * factor, CABLE_SPEED_STD * factor, limit,
                )
            )  # fmt: skip

        return update

    def _inclination_update(self, measured_ns: int, sines: Array) -> Callable[[float], float]:
        # The axes' directions then, seen from the body as it is now: R_now = R_then Exp(turn)
        turn = self._history.turned_since(measured_ns, self._bias[:3])
        axes = np.ascontiguousarray(self._axes @ Rotation.from_rotvec(turn).as_matrix())

        def update(limit: float) -> float:
            state = (self._p, self._R, self._v, self._bias, self._P)
            return float(strapdown.update_axes_up(*state, axes, sines, self._inclination_std, limit))

        return update

    def _believe(self, trust: Trust, stamp_ns: int, update: Callable[[float], float]) -> None:
        if trust.contradicted(stamp_ns, update):
            self._doubt(trust, stamp_ns, update)

    def _doubt(self, trust: Trust, stamp_ns: int, update: Callable[[float], float]) -> None:
        """The body is not where the tracker thinks: know so little of it that the measurement fits.

        Pose and velocity are widened in the proportions of a start; the velocity by no less than what moves
        the pose so far since the last measurement that fitted.
        """
        self.surprises += 1
        since = max(1e-3, (stamp_ns - trust.believed_ns) / 1e9)
        known, tolerance = self._P.copy(), self._rig.tolerance
        # A tilt tells by how much; that cables change their lengths, only that something is wrong
        for share in (1.0,) if trust is self._cables else 0.5 ** np.arange(12, 0, -1):
            spread = share * np.array(START_SPREAD)
            spread[2] = min(max(spread[2], spread[0] / since), START_SPREAD[2])
            self._P[:] = known
            std = np.repeat([*spread, tolerance["gyroscope_bias"], tolerance["accelerometer_bias"]], 3)
            self._P[np.arange(strapdown.ERRORS), np.arange(strapdown.ERRORS)] += std**2
            if update(float(trust.size)) <= trust.size:
                self._begun_ns, self._loose = self._last_ns, max(1.0, SETTLING_FACTOR * share**2)
                trust.begin(stamp_ns)
                return
        self.restarts += 1
        self._begin(self._last_ns)


def _latest(stamp_ns: Stamps, values: Array) -> Array:
    """(w,) mean of the samples of the last :data:`PULL_PERIOD`."""
    first = int(np.searchsorted(stamp_ns, stamp_ns[-1] - round(1e9 * PULL_PERIOD)))
    return np.asarray(np.mean(values[first:], axis=0))
