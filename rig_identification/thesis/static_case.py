"""Table 2.1, the case study of chapter 2, as a rig, a body and a dummy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.recording import Dummy
from rig_identification.rig import Cable, CarryingFrame, Rig
from rig_identification.thesis.tables import read_static_table

Array = NDArray[np.float64]

GRAVITY = 9.81  # m/s^2; no result of the statics without load cells depends on it
#: The printed axes have z down; turned half round x they are the rig's, z up.
TURN = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class StaticCase:
    """What hangs in chapter 2. Points in the rig's axes, z up; ``printed`` ones in the table's, z down."""

    rig: Rig  # with the carrying frame
    combined: Array  # (3,) m, centre of mass of body and frame, body frame
    body: Array  # (3,) m, of the body alone
    dummy: Dummy
    calculated: Array  # (3,) m, printed: what the thesis calculates of ``body``
    actual: Array  # (3,) m, printed


def load_static_case() -> StaticCase:
    """Return the case; how the table is read stands in its remarks."""
    table = read_static_table()
    printed = table["printed"]
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    ceiling = corners * [*printed["ceiling_frame"], 0.0] @ TURN
    hinges = corners * [*printed["carrying_frame"][:2], 0.0] @ TURN
    length = 1e-3 * printed["cable_length"]
    cables = tuple(Cable(f"cable_{i + 1}", ceiling[i], hinges[i], length) for i in range(4))
    body_mass, frame_mass = printed["body_mass"], printed["carrying_frame_mass"]
    body = 1e-3 * np.array(printed["body_center_of_gravity"], dtype=float) @ TURN
    middle = 0.5 * np.array(printed["carrying_frame"], dtype=float) @ TURN
    # The printed combined centre is rounded to a millimetre
    combined = (body_mass * body + frame_mass * middle) / (body_mass + frame_mass)
    rig = Rig(
        gravity=GRAVITY,
        cables=cables,
        mass=float(body_mass + frame_mass),
        frame=CarryingFrame(float(frame_mass), middle, np.eye(3)),
    )
    dummy = Dummy(
        printed["dummy_mass"], 1e-3 * np.array(printed["dummy_center_of_gravity"], dtype=float) @ TURN
    )
    published = table["published"]
    calculated, actual = (1e-3 * np.array(published[key], dtype=float) for key in ("calculated", "actual"))
    return StaticCase(rig, combined, body, dummy, calculated, actual)
