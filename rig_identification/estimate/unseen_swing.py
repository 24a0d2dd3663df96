"""How far a body swings and rolls where nothing that was measured tells.

A turn, or its rate, hardly feels that the body swings beside. Left free, a swing of metres would fit as well
as none. A person who sets a body turning lets it swing by a few degrees.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model.motion import State
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: rad, one standard deviation of a swing, and of rolling, at a run's start: three degrees.
SWING = 0.05
#: Share of that which is left to it until the turn itself is followed: before, a swing left free is bent to
#: what the turn lacks, and a fit stays in that valley.
CALM = 1e-2
#: Rows of a start state's derivatives: place and rotation, their rates, each along x and y.
ROWS = np.array([0, 1, 3, 4, 6, 7, 9, 10])


def swing_std(rig: Rig) -> Array:
    """(8,) std of what ROWS holds: m, rad, m/s, rad/s.

    A swing by an angle s on cables of length h is s h and s sqrt(g h) fast; rolling on hinges that span r
    is s sqrt(g / r) fast.
    """
    length = float(np.mean([cable.length for cable in rig.cables]))
    span = float(np.max(np.ptp([cable.body_point for cable in rig.cables], axis=0)))
    rates = SWING * np.sqrt(rig.gravity * np.array([length, 1.0 / max(span, 1e-3)]))
    return np.repeat([SWING * length, SWING, *rates], 2)


def swing_belief(rig: Rig, start: State, basis: Array, share: float = 1.0) -> tuple[float, Array, Array]:
    """(cost, information (b, b), negative gradient (b,)) of a run that hardly swings at its start.

    basis (X, b): directions in which the start may differ (prediction.start_basis). share: of that std.
    """
    ceiling = np.mean([cable.ceiling_point for cable in rig.cables], axis=0)
    body = np.mean([cable.body_point for cable in rig.cables], axis=0)
    away = np.concatenate(
        [
            (start.position - ceiling + body)[:2],
            Rotation.from_matrix(start.R_world_body).as_rotvec()[:2],
            start.velocity[:2],
            start.rate[:2],
        ]
    )
    std = share * swing_std(rig)
    rows, miss = basis[ROWS] / std[:, None], away / std
    return 0.5 * float(miss @ miss), rows.T @ rows, -rows.T @ miss
