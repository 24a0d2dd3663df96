"""The tracked body as serialized nav_msgs/Odometry, and back."""

from __future__ import annotations

import numpy as np
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from std_msgs.msg import Header

from rig_identification.live.tracked import Tracked
from rig_identification.nodes.wire import StampedDoubles, decode_batch

Array = NDArray[np.float64]
_TYPE = "nav_msgs/msg/Odometry"


class OdometryWriter:
    """Messages with full covariances: frame ``world``, child frame ``body``, twist in body axes."""

    def __init__(self) -> None:
        self._writer = StampedDoubles(Odometry(header=Header(frame_id="world"), child_frame_id="body"), 85)

    def serialize(self, tracked: Tracked) -> list[bytes]:
        """One message a sample."""
        n = len(tracked.stamp_ns)
        doubles = np.concatenate(
            [
                tracked.pose,
                tracked.pose_covariance.reshape(n, 36),
                tracked.twist,
                tracked.twist_covariance.reshape(n, 36),
            ],
            axis=1,
        )
        return self._writer.serialize(tracked.stamp_ns, doubles)


def read_odometry(messages: list[bytes]) -> tuple[NDArray[np.int64], Array]:
    """(n,) stamps and (n, 13) position, quaternion xyzw, velocity and rate in body axes."""
    return decode_batch("odometry", _TYPE, messages)
