"""The rig's frames by tf2, and its description for viewers."""

from __future__ import annotations

from typing import Any

import numpy as np
from builtin_interfaces.msg import Time as Stamp
from geometry_msgs.msg import TransformStamped
from numpy.typing import NDArray
from rclpy.time import Time
from std_msgs.msg import String

from rig_identification.live.frames import BODY, WORLD, fixed_frames
from rig_identification.live.robot_description import robot_description
from rig_identification.live.tracked import Tracked
from rig_identification.nodes.rig_node import LATCHED, RigNode, reliable
from rig_identification.rig import Rig

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # the package index has none: interfaces/build.sh builds it
    TFMessage = None  # type: ignore[assignment, misc, unused-ignore]

Array = NDArray[np.float64]
#: Depth of /tf, as tf2's own broadcaster has it.
_DEPTH = 100


class Transforms:
    """Publishes ``/tf_static`` and ``robot_description`` once, latched, and ``/tf`` when it is told to."""

    def __init__(self, node: RigNode, rig: Rig) -> None:
        self.told = "frames by tf2" if TFMessage else "no tf2: tf2_msgs cannot be imported"
        self._last_ns = 0
        # Kept: a latched message lives as long as its publisher
        self._description = node.create_publisher(String, "robot_description", LATCHED)
        self._description.publish(String(data=robot_description(rig)))
        self._moving: Any = None
        if TFMessage is None:
            return
        self._static = node.create_publisher(TFMessage, "/tf_static", LATCHED)
        stamp = node.get_clock().now().to_msg()
        fixed = [
            transform(frame.parent, frame.name, frame.position, frame.orientation, stamp)
            for frame in fixed_frames(rig)
        ]
        self._static.publish(TFMessage(transforms=fixed))
        self._moving = node.create_publisher(TFMessage, "/tf", reliable(_DEPTH))

    def publish(self, tracked: Tracked | None) -> None:
        """Publish the body's latest pose, if it is new."""
        if self._moving is None or tracked is None or int(tracked.stamp_ns[-1]) == self._last_ns:
            return
        self._last_ns = int(tracked.stamp_ns[-1])
        pose, stamp = tracked.pose[-1], Time(nanoseconds=self._last_ns).to_msg()
        self._moving.publish(TFMessage(transforms=[transform(WORLD, BODY, pose[:3], pose[3:], stamp)]))


def transform(parent: str, child: str, position: Array, orientation: Array, stamp: Stamp) -> TransformStamped:
    """Where a frame is in its parent: position (3,) m, orientation (4,) quaternion xyzw."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, stamp
    t, r = message.transform.translation, message.transform.rotation
    t.x, t.y, t.z = map(float, position)
    r.x, r.y, r.z, r.w = map(float, orientation)
    return message
