"""How well the generalized wrench is known, from the doubts about rig, sensors and centre of mass.

The wrench of :mod:`generalized_wrench` is linearised in everything it is made of. The pose is no
independent quantity: lengths, hinges and two inclinations give it (thesis section 2.3), so that a
hinge's error turns its cable and moves the body at once, and the two are propagated together,

    A (dp, dtheta) = B ds,    dw = D (dp, dtheta) + E ds,    P = S Q S^T,  S = D A^+ B + E     (i)

with s all doubts and Q their variances; A^+ is least squares where more than four cables hold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model.so3 import skew
from rig_identification.rig import Rig

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WrenchUncertainty:
    """Standard deviations (6,) of force N and moment N m about the centre of mass, body axes."""

    by_source: dict[str, Array]  # what is in doubt -> its share

    @property
    def std(self) -> Array:
        """(6,) all sources together."""
        return np.asarray(np.sqrt(sum(share**2 for share in self.by_source.values())))


def wrench_uncertainty(
    rig: Rig,
    pose: Array,
    tension: Array,
    exciter_force: Array,
    center_of_mass: Array,
    center_std: Array,
    weight: float = 0.0,
    weight_std: float = 0.0,
) -> WrenchUncertainty:
    """Uncertainty of one instant's wrench, each source by the rig's noise and tolerances.

    Parameters
    ----------
    pose : (7,)
        Position of the datum in world, m, and quaternion xyzw of body in world.
    tension : (n,)
        N, in the order of ``rig.cables``.
    exciter_force : (3,)
        N, exciter frame.
    center_of_mass, center_std : (3,)
        m, body frame.
    weight, weight_std : float
        N; a weight of 0 leaves gravity out. A tilt that is wrong turns it with everything else.
    """
    R = Rotation.from_quat(pose[3:]).as_matrix()
    columns = _cable_columns(rig, pose[:3], R, tension, center_of_mass, weight)
    total, force_columns = _force_columns(rig, tension, exciter_force, center_of_mass, pose[:3], R)
    noise, tolerance = rig.noise, rig.tolerance
    inclination = np.hypot(noise.get("inclination", 0.0), tolerance["inclinometer_orientation"])
    cells = np.hypot(noise.get("tension", 0.0), tolerance["load_cell_zero"])
    exciter = np.hypot(
        noise.get("exciter_force", 0.0), tolerance["exciter_gain"] * np.linalg.norm(exciter_force)
    )
    center = np.concatenate([np.zeros((3, 3)), skew(total)]) * center_std
    shares = {
        "load cells": np.hstack(
            [columns.tension * cells, columns.tension * tension * tolerance["load_cell_gain"]]
        ),
        "cable lengths": columns.length * tolerance["cable_length"],
        "hinges": columns.hinge * tolerance["hinge_position"],
        "inclination": columns.inclination * inclination,
        "exciter": force_columns * exciter,
        "centre of mass": center,
    }
    if weight > 0.0:
        shares["weight"] = np.concatenate([weight_std * R[2], np.zeros(3)])[:, None]
    return WrenchUncertainty({name: np.sqrt(np.sum(share**2, axis=1)) for name, share in shares.items()})


@dataclass(frozen=True)
class _Columns:
    """Derivatives of the wrench."""

    tension: Array  # (6, n)
    length: Array  # (6, n)
    hinge: Array  # (6, 6 n): ceiling's, body's
    inclination: Array  # (6, 2)


def _cable_columns(
    rig: Rig, position: Array, R: Array, tension: Array, center: Array, weight: float
) -> _Columns:
    n = len(rig.cables)
    along = np.zeros((6, n))
    in_pose, in_hinge = np.zeros((6, 6)), np.zeros((6, 6 * n))
    length_in_pose, length_in_hinge = np.zeros((n, 6)), np.zeros((n, 6 * n))
    for i, cable in enumerate(rig.cables):
        b, arm = cable.body_point, cable.body_point - center
        ceiling = R.T @ (cable.ceiling_point - position)  # from the datum, body axes
        span = float(np.linalg.norm(ceiling - b))
        u = (ceiling - b) / span
        stiff = tension[i] / span * (np.eye(3) - np.outer(u, u))
        lever = np.concatenate([np.eye(3), skew(arm)])
        along[:, i] = lever @ u
        # ceiling' = R^T (dc - dp) + ceiling x dtheta
        from_ceiling = np.hstack([-R.T, skew(ceiling)])
        in_pose += lever @ stiff @ from_ceiling
        length_in_pose[i] = u @ from_ceiling
        c, h = slice(3 * i, 3 * i + 3), slice(3 * (n + i), 3 * (n + i) + 3)
        in_hinge[:, c], in_hinge[:, h] = lever @ stiff @ R.T, -lever @ stiff
        in_hinge[3:, h] -= tension[i] * skew(u)  # the arm itself
        length_in_hinge[i, c], length_in_hinge[i, h] = u @ R.T, -u
    # The vertical in body axes, up' = up + up x dtheta
    in_pose[:3, 3:] -= weight * skew(R[2])
    tilt = np.hstack([np.zeros((2, 3)), skew(R[2])[:2]])
    solved = in_pose @ np.linalg.pinv(np.vstack([length_in_pose, tilt]))
    return _Columns(along, solved[:, :n], in_hinge - solved[:, :n] @ length_in_hinge, solved[:, n:])


def _force_columns(
    rig: Rig, tension: Array, force: Array, center: Array, position: Array, R: Array
) -> tuple[Array, Array]:
    """Force of cables and exciter (3,), body axes, and the wrench's derivative in the exciter's (6, 3)."""
    total = np.zeros(3)
    for pull, cable in zip(tension, rig.cables, strict=True):
        along = R.T @ (cable.ceiling_point - position) - cable.body_point
        total += pull * along / np.linalg.norm(along)
    if rig.exciter is None:
        return total, np.zeros((6, 3))
    turn = Rotation.from_quat(rig.exciter.orientation).as_matrix()
    lever = np.concatenate([np.eye(3), skew(rig.exciter.position - center)])
    return total + turn @ force, lever @ turn
