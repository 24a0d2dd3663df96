"""Noise-free readings of every device at the nodes, from the sensors of the forward model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.parameters import DeviceLayout
from rig_identification.model import sensors
from rig_identification.rig import Mount, Rig

Array = NDArray[np.float64]

#: Nodes read at a time: a reading carries its derivatives, which take two hundred times its room.
PART = 4096


@dataclass(frozen=True)
class Mounts:
    """Devices as described; their own numbers say how they truly are."""

    rig: Rig
    places: DeviceLayout
    world_in_tracker: Mount
    R_tracker_mean: Array  # (3, 3) marker orientation near all that occur (sensors.mocap)

    def read(self, device: str, outputs: Array, R_world_body: Array, own: Array) -> Array:
        """(N, w) readings of one device, as the forward model's sensors give them (see :meth:`poses`).

        outputs (N, 18 + n), R_world_body (N, 3, 3): of the nodes. own: flat array of DeviceLayout.
        """
        parts = []
        for first in range(0, outputs.shape[0], PART):
            here = slice(first, first + PART)
            parts.append(self._read(device, outputs[here], R_world_body[here], own).values)
        return np.concatenate(parts)

    def _read(self, device: str, outputs: Array, R_world_body: Array, own: Array) -> sensors.Reading:
        rig, places = self.rig, self.places
        numbers = own[places.own(device)]
        if device == "imu" and rig.imu is not None:
            turn = Rotation.from_quat(rig.imu.orientation).as_matrix()
            return sensors.imu(outputs, rig.imu.position, turn, numbers)
        if device == "inclinometer" and rig.inclinometer is not None:
            turn = Rotation.from_quat(rig.inclinometer.orientation).as_matrix()
            return sensors.inclinometer(outputs, turn, numbers)
        if device == "mocap":
            return sensors.mocap(outputs, R_world_body, self.mocap, self.R_tracker_mean, numbers)
        return sensors.load_cell(outputs, places.cables.index(device), numbers)

    @property
    def mocap(self) -> sensors.MocapMount:
        """Marker frame on the body (on the datum where none is described) and world in the tracker."""
        marker = self.rig.mocap
        return sensors.MocapMount(
            np.zeros(3) if marker is None else marker.position,
            np.eye(3) if marker is None else Rotation.from_quat(marker.orientation).as_matrix(),
            self.world_in_tracker.position,
            Rotation.from_quat(self.world_in_tracker.orientation).as_matrix(),
        )

    def poses(self, values: Array) -> Array:
        """(n, 7) position and quaternion xyzw of (n, 6) motion-capture readings."""
        turns = Rotation.from_matrix(self.R_tracker_mean) * Rotation.from_rotvec(values[:, 3:])
        return np.concatenate([values[:, :3], turns.as_quat()], axis=1)


def mounts_near(rig: Rig, places: DeviceLayout, world_in_tracker: Mount, R_world_body: Array) -> Mounts:
    """Mounts for motion about one orientation of the body (3, 3)."""
    R_tracker_world = Rotation.from_quat(world_in_tracker.orientation).as_matrix()
    marker = np.eye(3) if rig.mocap is None else Rotation.from_quat(rig.mocap.orientation).as_matrix()
    return Mounts(rig, places, world_in_tracker, R_tracker_world @ R_world_body @ marker)
