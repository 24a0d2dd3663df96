"""Force and moment on the body about its centre of mass, from measured tensions and exciter force."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.rig import Rig
from rig_identification.statics.balance import Suspension, spans

Array = NDArray[np.float64]


def generalized_wrench(
    rig: Rig,
    pose: Array,
    tension: Array,
    exciter_force: Array,
    center_of_mass: Array,
    weight: float = 0.0,
) -> Array:
    """(k, 6) force N and moment about the centre of mass N m, body axes.

    Parameters
    ----------
    pose : (k, 7)
        Position of the datum in world, m, and quaternion xyzw of body in world.
    tension : (k, n)
        N, in the order of ``rig.cables``.
    exciter_force : (k, 3)
        N, exciter frame; zeros where there is none.
    center_of_mass : (3,)
        m, body frame.
    weight : float
        N; 0 leaves gravity out. It has no moment about the centre of mass.
    """
    position, R = pose[:, :3], Rotation.from_quat(pose[:, 3:]).as_matrix()
    out = np.zeros((len(pose), 6))
    unit = spans(Suspension.of(rig), position, R)[3]
    pulls = (tension - rig.cable_weight_at_cells(unit[..., 2]))[..., None] * unit
    for i, cable in enumerate(rig.cables):
        _add(out, np.einsum("kji,kj->ki", R, pulls[:, i]), cable.body_point - center_of_mass)
    if rig.exciter is not None:
        turn = Rotation.from_quat(rig.exciter.orientation).as_matrix()
        _add(out, exciter_force @ turn.T, rig.exciter.position - center_of_mass)
    out[:, :3] -= weight * R[:, 2]
    return out


def _add(wrench: Array, force: Array, arm: Array) -> None:
    wrench[:, :3] += force
    wrench[:, 3:] += np.cross(arm, force)
