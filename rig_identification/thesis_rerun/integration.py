"""Chapter 3's pose by integration of gyroscope and accelerometer alone, and its Figures 4.1 and 4.2.

The figures show the "world sensor" beside the tracker that reads the "body sensor", in percent:
the centre of mass' three coordinates and the nine elements of T, world into body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.live import strapdown
from rig_identification.simulate.thesis_case import NOISE
from rig_identification.thesis_rerun.motion import CaseMotion

Array = NDArray[np.float64]

#: An element of T smaller than this has no percentage worth drawing.
LEAST = 1e-3


@dataclass(frozen=True)
class IntegratedPose:
    """Pose by integration over the thesis' samples, and the true one."""

    time: Array  # (k,) s
    center: Array  # (k, 3) m, centre of mass in world
    T: Array  # (k, 3, 3) world into body
    true_center: Array  # (k, 3)
    true_T: Array  # (k, 3, 3)

    @property
    def center_percent(self) -> Array:
        """(k, 3) error in percent of the true coordinate: Figure 4.1."""
        return _percent(self.center, self.true_center)

    @property
    def T_percent(self) -> Array:
        """(k, 3, 3) error in percent of the true element, NaN where that is next to nothing: Figure 4.2."""
        return _percent(self.T, self.true_T)


@dataclass(frozen=True)
class IntegrationCheck:
    """The thesis' data consistency check (section 4.1.1) on one case."""

    case: str
    ideal: IntegratedPose  # sensors without noise, as in the thesis
    noisy: IntegratedPose  # with the noise of good industrial sensors

    @property
    def statement(self) -> str:
        """What the figures show."""
        (center, turn), (noisy_center, noisy_turn) = (
            (np.max(np.abs(pose.center_percent)), np.max(np.abs(pose.T - pose.true_T)))
            for pose in (self.ideal, self.noisy)
        )
        return (
            "The pose by integration alone, from its true start (the thesis' Figures 4.1 and 4.2), errs by "
            f"at most {center:.1g} percent of a coordinate and {turn:.1g} in an element of T without sensor "
            f"noise (blue), as the thesis finds, and by {noisy_center:.1g} percent and {noisy_turn:.1g} with "
            "it (red)."
        )


def integrate(
    time: Array, rate: Array, force: Array, start: tuple[Array, Array, Array], gravity: float
) -> tuple[Array, Array]:
    """(position (n, 3) in world, R_world_body (n, 3, 3)) of the IMU by integration from ``start``.

    rate, force : (n, 3)
        rad/s and m/s^2 along body axes at ``time`` (n,).
    start : position (3,), R_world_body (3, 3), velocity (3,)
    """
    p, R, v = (np.array(part, dtype=float, order="C") for part in start)
    bias, P, noise = np.zeros(6), np.zeros((strapdown.ERRORS,) * 2), np.zeros(4)
    positions, turns = np.zeros((time.size, 3)), np.zeros((time.size, 3, 3))
    positions[0], turns[0] = p, R
    for k in range(time.size - 1):
        w, f = 0.5 * (rate[k] + rate[k + 1]), 0.5 * (force[k] + force[k + 1])
        strapdown.propagate_sample(p, R, v, bias, P, w, f, float(time[k + 1] - time[k]), gravity, noise)
        positions[k + 1], turns[k + 1] = p, R
    return positions, turns


def check_integration(motion: CaseMotion, seed: int) -> IntegrationCheck:
    """Integrate a case's body sensor, which sits on the centre of mass, from its true start."""
    rng = np.random.default_rng(seed)
    ideal = _integrated(motion, 0.0, 0.0, rng)
    noisy = _integrated(motion, NOISE["angular_rate"], NOISE["specific_force"], rng)
    return IntegrationCheck(motion.case.label, ideal, noisy)


def _integrated(
    motion: CaseMotion, rate_noise: float, force_noise: float, rng: np.random.Generator
) -> IntegratedPose:
    case = motion.case
    nodes = motion.samples((0.0, case.duration))
    time = np.asarray(motion.time[nodes], dtype=np.float64)
    rate = motion.rate[nodes] + rate_noise * rng.standard_normal((nodes.size, 3))
    force = motion.specific_force[nodes] + force_noise * rng.standard_normal((nodes.size, 3))
    arm = np.cross(motion.rate[0], case.center_of_mass)
    velocity = motion.velocity[0] + motion.R_world_body[0] @ arm
    start = (motion.center[0], motion.R_world_body[0], velocity)
    center, turns = integrate(time, rate, force, start, case.rig.gravity)
    true_T = motion.R_world_body[nodes].transpose(0, 2, 1)
    return IntegratedPose(time, center, turns.transpose(0, 2, 1), motion.center[nodes], true_T)


def _percent(found: Array, true: Array) -> Array:
    return np.asarray(100.0 * (found - true) / np.where(np.abs(true) < LEAST, np.nan, np.abs(true)))
