"""Serialized messages to numbers and back, in bulk: at 7000 messages a second each must cost little."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState

from rig_identification.session.cdr import decode
from rig_identification.session.raw_topic import Collector
from rig_identification.topics import Topic

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

#: Message classes of the contract's topics.
TYPES: dict[str, Any] = {
    "geometry_msgs/msg/WrenchStamped": WrenchStamped,
    "geometry_msgs/msg/Vector3Stamped": Vector3Stamped,
    "geometry_msgs/msg/PoseStamped": PoseStamped,
    "nav_msgs/msg/Odometry": Odometry,
    "sensor_msgs/msg/Imu": Imu,
    "sensor_msgs/msg/JointState": JointState,
}
#: Columns of a decoded message that carry the channel's quantity.
_COLUMNS = {"tension": 3, "exciter_force": 3, "inclination": 2}


def decode_batch(name: str, message_type: str, messages: Sequence[bytes]) -> tuple[Stamps, Array]:
    """(n,) stamps in ns and (n, w) numbers of serialized messages of one topic (see session/cdr.py).

    Raises InputError where a message does not deserialize.
    """
    collector = Collector()
    collector.add(name, np.zeros(len(messages), np.int64), messages)
    return decode(collector.take(name, message_type))


def channel_values(topic: Topic, decoded: Array) -> Array:
    """(n, w) the channel's quantity: tension (n, 1), force (n, 3), imu (n, 6), inclination (n, 2), ..."""
    if topic.channel == "tension":
        return decoded[:, 2:3]
    return decoded[:, : _COLUMNS.get(topic.channel, decoded.shape[1])]


class StampedDoubles:
    """Writes messages of one type whose numbers all stand at the end; all but stamp and numbers stays."""

    def __init__(self, template: object, count: int) -> None:
        self._template = np.frombuffer(serialize_message(template), np.uint8)
        self._count = count

    def serialize(self, stamp_ns: Stamps, values: Array) -> list[bytes]:
        """Messages for stamps (n,) and values (n, count)."""
        rows = np.tile(self._template, (len(stamp_ns), 1))
        seconds, nanoseconds = np.divmod(stamp_ns, 1_000_000_000)
        rows[:, 4:8] = seconds.astype("<i4")[:, None].view(np.uint8)
        rows[:, 8:12] = nanoseconds.astype("<u4")[:, None].view(np.uint8)
        numbers = np.ascontiguousarray(values, dtype="<f8")
        rows[:, -8 * self._count :] = numbers.view(np.uint8)
        return [row.tobytes() for row in rows]
