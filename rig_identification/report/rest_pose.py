"""Where the body hangs at rest, well enough for a drawing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.rig import Rig

Array = NDArray[np.float64]


def rest_pose(rig: Rig, center_of_mass_body: Array) -> tuple[Array, Array]:
    """Pose of least potential energy with no cable longer than described.

    Parameters
    ----------
    rig : Rig
    center_of_mass_body : (3,) array
        m, body.

    Returns
    -------
    (3, 3) array, (3,) array
        ``R_world_body`` and the position of ``body`` in ``world``, m.
    """
    ceiling = np.array([c.ceiling_point for c in rig.cables])
    points = np.array([c.body_point for c in rig.cables])
    lengths = np.array([c.length for c in rig.cables])
    start = _level_start(ceiling, points, lengths)

    def pose(unknown: Array) -> tuple[Array, Array]:
        return Rotation.from_rotvec(unknown[3:]).as_matrix() @ _yaw(start[3]), unknown[:3]

    def height(unknown: Array) -> float:
        R_world_body, position_world = pose(unknown)
        return float(position_world[2] + (R_world_body @ center_of_mass_body)[2])

    def spare_length(unknown: Array) -> Array:
        R_world_body, position_world = pose(unknown)
        reach = position_world + points @ R_world_body.T - ceiling
        return np.asarray(lengths**2 - np.sum(reach**2, axis=1))

    from scipy.optimize import minimize  # takes a tenth of a second: not where nothing is drawn

    first = np.concatenate([start[:3], np.zeros(3)])
    found = minimize(
        height,
        first,
        method="SLSQP",
        constraints={"type": "ineq", "fun": spare_length},
        options={"maxiter": 200},
    )
    best = found.x if np.all(np.isfinite(found.x)) else first
    return pose(best)


def _level_start(ceiling: Array, points: Array, lengths: Array) -> Array:
    """Level body under the middle of the ceiling points, turned to match them: x, y, z, yaw."""
    above, below = ceiling - ceiling.mean(axis=0), points - points.mean(axis=0)
    turn = np.arctan2(
        np.sum(below[:, 0] * above[:, 1] - below[:, 1] * above[:, 0]), np.sum(below[:, :2] * above[:, :2])
    )
    middle = ceiling.mean(axis=0) - _yaw(turn) @ points.mean(axis=0)
    return np.append(middle - [0.0, 0.0, 0.95 * lengths.min()], turn)


def _yaw(angle: float) -> Array:
    return np.asarray(Rotation.from_euler("z", angle).as_matrix())
