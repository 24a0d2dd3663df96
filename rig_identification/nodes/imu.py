"""``imu``: angular rate and specific force at the IMU's origin, in its frame."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.model import sensors
from rig_identification.nodes.sensor_node import Device, MountError, SensorNode, noise_names
from rig_identification.rig import Rig


def device(rig: Rig) -> Device:
    """Six columns. Raises InputError where the rig has no IMU."""
    mount = rig.imu
    if mount is None:
        raise InputError(
            "the rig description has no imu; add its position and orientation, or do not start this node"
        )
    orientation = Rotation.from_quat(mount.orientation).as_matrix()

    def read(rows: NDArray[np.float64], error: MountError) -> NDArray[np.float64]:
        own = np.zeros(sensors.IMU_SIZE)
        own[0:3], own[3:6] = error.position, error.rotation
        return sensors.imu(rows, mount.position, orientation, own).values

    noise = noise_names(("angular_rate", 3), ("specific_force", 3))
    return Device("imu", 6, (("imu/data_raw", slice(0, 6)),), noise, read)


def create() -> SensorNode:
    """The node."""
    return SensorNode("imu", device)
