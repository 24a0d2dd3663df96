"""A body at rest on cables: the equations of chapter 2 and their exact derivatives.

At position p (body origin in world) and attitude R (body vectors into world), with arms
a_i = R b_i, spans e_i = c_i - p - a_i, directions u_i = e_i / |e_i| and tensions t_i
(Kutluay, equation numbers of the thesis in brackets):

    lengths   |e_i| - l_i = 0                                 (2.13) to (2.16)
    forces    sum t_i u_i - M g z = 0                         (2.20) to (2.22)
    moments   sum a_i x t_i u_i - (R s) x g z = 0             (2.23) to (2.25), about the body origin

M is the mass that hangs, s its first moment in body (kg m). The thesis carries R's nine
elements with the orthonormality conditions (2.7) to (2.12); here R is a rotation throughout
and changes by a rotation vector theta on the left, R <- exp(theta) R.

Rows are divided by L = 1 m and the weight Mg, so that all of them are of order one; tensions
are in units of the weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.model.so3 import skew
from rig_identification.rig import Rig

Array = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Suspension:
    """Where the cables are hinged and how long they are."""

    ceiling: Array  # (n, 3) m, world
    body: Array  # (n, 3) m, body
    length: Array  # (n,) m

    @classmethod
    def of(cls, rig: Rig) -> Suspension:
        """Take the cables of a rig description in their order."""
        return cls(
            np.array([cable.ceiling_point for cable in rig.cables], dtype=float),
            np.array([cable.body_point for cable in rig.cables], dtype=float),
            np.array([cable.length for cable in rig.cables], dtype=float),
        )

    def only(self, cables: NDArray[np.intp]) -> Suspension:
        """The same suspension with the chosen cables alone, by index."""
        return Suspension(self.ceiling[cables], self.body[cables], self.length[cables])


@dataclass(frozen=True)
class Balance:
    """Residuals of lengths, forces and moments, and their slopes; leading axes are a batch."""

    residual: Array  # (..., n + 6)
    pose_slope: Array  # (..., n + 6, 6) in position (m, world) and rotation vector (rad, world)
    tension_slope: Array  # (..., n + 6, n) in tensions (weights)


def balance(
    suspension: Suspension, arm_of_mass: Array, position: Array, attitude: Array, tension: Array
) -> Balance:
    """Evaluate the equations at position (..., 3), attitude (..., 3, 3), tension (..., n) in weights.

    ``arm_of_mass`` is s / M, (3,) m, body: the centre of all that hangs.
    """
    arms, _, distance, unit = spans(suspension, position, attitude)
    pull = tension[..., None] * unit
    center = np.einsum("...ij,j->...i", attitude, arm_of_mass)
    force = pull.sum(-2) - UP
    moment = np.cross(arms, pull).sum(-2) - np.cross(center, UP)
    residual = np.concatenate([distance - suspension.length, force, moment], -1)
    return Balance(
        residual,
        _pose_slope(arms, distance, unit, tension, center),
        _tension_slope(arms, unit),
    )


def spans(suspension: Suspension, position: Array, attitude: Array) -> tuple[Array, Array, Array, Array]:
    """Arms, spans (..., n, 3), distances (..., n) and unit directions towards the ceiling."""
    arms = np.einsum("...ij,nj->...ni", attitude, suspension.body)
    span = suspension.ceiling - position[..., None, :] - arms
    distance = np.linalg.norm(span, axis=-1)
    return arms, span, distance, span / distance[..., None]


def hinge_stiffness(distance: Array, unit: Array, tension: Array) -> Array:
    """(..., n, 3, 3): a hinge that moves by d changes its cable's force by minus this times d."""
    across = np.eye(3) - unit[..., :, None] * unit[..., None, :]
    return np.asarray((tension / distance)[..., None, None] * across)


def _pose_slope(arms: Array, distance: Array, unit: Array, tension: Array, center: Array) -> Array:
    stiffness = hinge_stiffness(distance, unit, tension)
    arm_cross = skew(arms)
    lengths = -np.concatenate([unit, np.cross(arms, unit)], -1)
    force = np.concatenate([-stiffness.sum(-3), (stiffness @ arm_cross).sum(-3)], -1)
    pull_cross = skew(tension[..., None] * unit)
    turned = arm_cross @ stiffness @ arm_cross + pull_cross @ arm_cross
    weight = skew(np.broadcast_to(UP, center.shape)) @ skew(center)
    moment = np.concatenate([-(arm_cross @ stiffness).sum(-3), turned.sum(-3) - weight], -1)
    return np.concatenate([lengths, force, moment], -2)


def _tension_slope(arms: Array, unit: Array) -> Array:
    lengths = np.zeros((*unit.shape[:-1], unit.shape[-2]))
    wrench = np.concatenate([unit, np.cross(arms, unit)], -1)
    return np.concatenate([lengths, np.swapaxes(wrench, -1, -2)], -2)


def is_stable(at: Balance, cables: int) -> bool:
    """Whether every small motion that the cables allow raises the body (unbatched).

    The potential energy's second variation is minus the slope of the wrench, restricted to
    the null space of the length conditions.
    """
    allowed = null_space(at.pose_slope[:cables])
    if allowed.shape[1] == 0:
        return True
    stiffness = -allowed.T @ at.pose_slope[cables:] @ allowed
    return bool(np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[0] > 0.0)


def null_space(matrix: Array, tolerance: float = 1e-9) -> Array:
    """Orthonormal columns that the matrix takes to zero, singular values below tolerance counted so."""
    _, values, rows = np.linalg.svd(matrix)
    rank = int(np.sum(values > tolerance * max(values[0], 1e-300))) if values.size else 0
    return np.asarray(rows[rank:].T)


def undetermined_tensions(at: Balance, cables: int) -> int:
    """How many combinations of tensions leave the body in balance: self-stress of rigid cables.

    Four parallel cables have one, any rig of more than six at least n - 6 (unbatched).
    """
    return int(null_space(at.tension_slope[cables:], 1e-7).shape[1])
