"""The nearest pose that a body on rigid cables can take: printed poses have four digits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError

Array = NDArray[np.float64]


def hang_on_cables(
    position: Array, attitude: Rotation, ceiling: Array, body: Array, lengths: Array
) -> tuple[Array, Rotation]:
    """Return position (3,) and attitude moved as little as possible onto the cables.

    Newton's method on |p + R b_i - c_i|^2 = l_i^2 with minimum-norm steps; ``ceiling`` and
    ``body`` are (n, 3) m, ``lengths`` (n,) m. Raises ``InputError`` where no such pose is near.
    """
    for _ in range(50):
        arms = attitude.apply(body)
        spans = position + arms - ceiling
        gap = 0.5 * (np.einsum("ij,ij->i", spans, spans) - lengths**2)
        if np.max(np.abs(gap)) < 1e-13:
            return position, attitude
        slope = np.hstack([spans, np.cross(arms, spans)])
        step = np.linalg.lstsq(slope, -gap, rcond=1e-10)[0]
        position = position + step[:3]
        attitude = Rotation.from_rotvec(step[3:]) * attitude
    worst = float(np.max(np.abs(np.linalg.norm(spans, axis=1) - lengths)))
    raise InputError(
        f"initial pose: cables miss their lengths by {worst:.3g} m and no pose near it fits; check it"
    )
