"""What the tracker says of the body, and how well it knows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.live import strapdown
from rig_identification.model.so3 import skew

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class Tracked:
    """The body at the stamps of IMU samples."""

    stamp_ns: Stamps  # (n,)
    pose: Array  # (n, 7) position of the datum in world m, quaternion xyzw of body in world
    pose_covariance: Array  # (n, 6, 6) position (world), rotation (world axes)
    twist: Array  # (n, 6) velocity of the datum m/s, angular rate rad/s, body axes
    twist_covariance: Array  # (n, 6, 6)


def pose_covariance(R: Array, P: Array, arm: Array, tolerance: dict[str, float]) -> Array:
    """(n, 6, 6) of the datum; what the lab believes of lengths does not average out.

    R (n, 3, 3): of body in world; P (n, 15, 15): as in strapdown.py; arm (3, 3): cross product with the
    IMU's position.
    """
    J = np.zeros((len(R), 6, strapdown.ERRORS))
    J[:, :3, 0:3] = np.eye(3)
    J[:, :3, 3:6] = R @ arm
    J[:, 3:, 3:6] = R
    out = J @ P @ J.transpose(0, 2, 1)
    floor = tolerance["cable_length"] ** 2 + tolerance["hinge_position"] ** 2
    out[:, np.arange(3), np.arange(3)] += floor
    out[:, np.arange(3, 6), np.arange(3, 6)] += tolerance["level"] ** 2
    return np.asarray(out)


def twist_covariance(R: Array, P: Array, arm: Array, velocity: Array, rate_std: float) -> Array:
    """(n, 6, 6) of the datum's velocity and the rate, body axes; velocity (3,): of the IMU, world."""
    J = np.zeros((len(R), 6, strapdown.ERRORS))
    Rt = R.transpose(0, 2, 1)
    J[:, :3, 6:9] = Rt
    J[:, :3, 3:6] = skew(np.einsum("nij,j->ni", Rt, velocity))
    J[:, :3, 9:12] = -arm
    J[:, 3:, 9:12] = -np.eye(3)
    out = J @ P @ J.transpose(0, 2, 1)
    out[:, np.arange(3, 6), np.arange(3, 6)] += rate_std**2
    return np.asarray(out)
