"""Rigs with more cables than their motion needs: fewer hold the same kinematics, and none the shares of load.

A fourth parallel cable forbids nothing that three do not forbid already. Inextensible cables share the load
in no defined way then, and a tenth of a millimetre decides which of them is slack: four given lengths fit
no pose at all. So such a body is taken to hang on as many cables as are independent, which moves it alike,
and its load cells, whose shares the model does not define, are left aside.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from rig_identification.estimate.first_guess import first_elements
from rig_identification.model.constraints import rigid_jacobian
from rig_identification.model.equilibrium import design_pose
from rig_identification.model.motion import rig_model
from rig_identification.recording import Recording, Session
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: A cable forbids nothing of its own where what it forbids beyond the others is this part of what it forbids:
#: hinges known to half a millimetre leave the directions of cables of a few metres open by as much.
INDEPENDENT = 1e-3

NOTE = (
    "{names} forbid the body nothing that the other cables do not forbid already. How such cables share the "
    "load is not defined: the body is taken to hang on {kept}, and the load cells are left aside. Hang it on "
    "these alone to use them."
)


def independent_cables(rig: Rig, session: Session) -> list[int]:
    """Indices of cables that hold the body as all of them do, in order."""
    model = rig_model(rig, first_elements(session))
    state = design_pose(model)
    n = len(rig.cables)
    G, gap, rate = np.zeros((n, 6)), np.zeros(n), np.zeros(n)
    R = np.array(state.R_world_body, order="C")
    count = rigid_jacobian(model.physics, model.modes, state.vector(model.states), R, G, gap, rate)
    if count < n or n > 6:
        return list(range(n))
    # Turns in metres at the hinges, about their middle
    middle = np.mean([cable.body_point for cable in rig.cables], axis=0)
    arms = np.linalg.norm([cable.body_point - middle for cable in rig.cables], axis=1)
    G[:, 3:] /= max(float(np.max(arms)), 1e-6)
    G /= np.linalg.norm(G, axis=1, keepdims=True)
    _, R_factor, pivot = qr(G.T, mode="economic", pivoting=True)
    size = np.abs(np.diag(R_factor))
    return sorted(int(i) for i in pivot[: np.count_nonzero(size > INDEPENDENT)])


def determinate(session: Session) -> tuple[Session, str | None]:
    """The session on independent cables, and what is told of the others; as it is where all are."""
    rig = session.rig
    kept = independent_cables(rig, session)
    if len(kept) == len(rig.cables) or len(kept) < 2:
        return session, None

    def without(recording: Recording) -> Recording:
        return replace(recording, tension={})

    names = [cable.name for cable in rig.cables]
    note = NOTE.format(
        names=" and ".join(name for i, name in enumerate(names) if i not in kept),
        kept=", ".join(names[i] for i in kept),
    )
    rig = replace(rig, cables=tuple(rig.cables[i] for i in kept))
    return replace(session, rig=rig, recordings=tuple(without(r) for r in session.recordings)), note
