"""``inclinometer``: angles of its x and y axis above the horizontal plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.model import sensors
from rig_identification.nodes.sensor_node import Device, MountError, SensorNode, noise_names
from rig_identification.rig import Rig


def device(rig: Rig) -> Device:
    """Two columns. Raises InputError where the rig has no inclinometer."""
    mount = rig.inclinometer
    if mount is None:
        raise InputError(
            "the rig description has no inclinometer; add its orientation, or do not start this node"
        )
    orientation = Rotation.from_quat(mount.orientation).as_matrix()

    def read(rows: NDArray[np.float64], error: MountError) -> NDArray[np.float64]:
        return sensors.inclinometer(rows, orientation, np.concatenate([error.rotation, np.zeros(2)])).values

    return Device(
        "inclinometer",
        2,
        (("inclinometer/angles", slice(0, 2)),),
        noise_names(("inclination", 2)),
        read,
        placed=False,
    )


def create() -> SensorNode:
    """The node."""
    return SensorNode("inclinometer", device)
