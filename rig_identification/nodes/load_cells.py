"""``load_cells``: one WrenchStamped topic a cable, and the exciter's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.model import layout
from rig_identification.nodes.sensor_node import Device, MountError, SensorNode, columns_of, noise_names
from rig_identification.rig import Rig


def device(rig: Rig) -> Device:
    """One column a cable, then the exciter's force in its frame where the rig has one."""
    cables = [cable.name for cable in rig.cables]
    n = len(cables)
    exciter = 3 if rig.exciter is not None else 0
    topics = [f"{name}/wrench" for name in cables] + (["exciter/wrench"] if exciter else [])
    slices = columns_of([1] * n + ([3] if exciter else []))

    def read(rows: NDArray[np.float64], error: MountError) -> NDArray[np.float64]:
        _ = error  # cells sit in the cables
        return rows[:, layout.OUT_TENSION : layout.OUT_TENSION + n + exciter]

    noise = noise_names(("tension", n), ("exciter_force", exciter))
    return Device(
        "load_cells",
        n + exciter,
        tuple(zip(topics, slices, strict=True)),
        noise,
        read,
        placed=False,
        turned=False,
    )


def create() -> SensorNode:
    """The node."""
    return SensorNode("load_cells", device)
