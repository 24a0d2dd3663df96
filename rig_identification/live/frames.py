"""The rig's coordinate frames: where a description puts the devices and both ends of each cable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import Mount, Rig

Array = NDArray[np.float64]

WORLD, BODY = "world", "body"
#: Quaternion xyzw of a frame whose axes are its parent's.
ALIGNED = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Frame:
    """A frame that does not move in its parent."""

    name: str
    parent: str
    position: Array  # (3,) m, in the parent
    orientation: Array  # (4,) quaternion xyzw, rotates vectors of this frame into the parent's axes


def fixed_frames(rig: Rig) -> tuple[Frame, ...]:
    """Devices on the body, and each cable's ends: ``<cable>_ceiling`` in world, ``<cable>_body`` in body.

    A described motion capture is the frame of its markers, ``mocap``. An inclinometer has no described
    position and sits at the body's origin.
    """
    frames = []
    for cable in rig.cables:
        frames.append(Frame(f"{cable.name}_ceiling", WORLD, cable.ceiling_point, ALIGNED))
        frames.append(Frame(f"{cable.name}_body", BODY, cable.body_point, ALIGNED))
    devices: dict[str, Mount | None] = {
        "imu": rig.imu,
        "inclinometer": rig.inclinometer,
        "exciter": rig.exciter,
        "mocap": rig.mocap,
    }
    frames += [
        Frame(name, BODY, mount.position, mount.orientation)
        for name, mount in devices.items()
        if mount is not None
    ]
    return tuple(frames)
