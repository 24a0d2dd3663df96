"""A body of which only size and weight are known: a box of even density."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import Rig

Array = NDArray[np.float64]


def box(rig: Rig, mass: float, size: Array, center: Array | None = None) -> Array:
    """(10,) m, c, J of a box.

    mass: kg. size (3,): edges along the body's axes, m. center (3,): of the box, m, body; none given: in the
    middle below the hinges, with its upper side as high as they are on average.
    """
    if center is None:
        hinges = np.array([cable.body_point for cable in rig.cables])
        center = np.mean(hinges, axis=0) - [0.0, 0.0, 0.5 * size[2]]
    x, y, z = np.asarray(size, dtype=float) ** 2 * mass / 12.0
    return np.array([mass, *center, y + z, 0.0, 0.0, x + z, 0.0, x + y])
