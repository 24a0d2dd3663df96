"""Series to serialized messages: one message by rosbags as a template, its numbers replaced in bulk.

In every message used here the numbers stand at the end, at a place that depends on nothing but the type.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from rig_identification.recording import Array
from rig_identification.topics import Topic

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)
_DEVICE_FRAMES = {
    "exciter_force": "exciter",
    "exciter_shaft": "exciter",
    "imu": "imu",
    "inclination": "inclinometer",
    "mocap": "tracker",
    "ground_truth": "world",
}


def serialize(topic: Topic, stamp_ns: NDArray[np.int64], values: Array) -> NDArray[np.uint8]:
    """Messages of one topic.

    Parameters
    ----------
    topic : Topic
        Where the messages go.
    stamp_ns : (n,) int64
        ``header.stamp``.
    values : (n, width)
        As in :class:`~rig_identification.recording.Recording` for the topic's channel.

    Returns
    -------
    (n, length) uint8
        CDR, little-endian, one message a row.
    """
    template = np.frombuffer(TYPESTORE.serialize_cdr(_template(topic), topic.message_type), np.uint8)
    messages = np.tile(template, (len(stamp_ns), 1))
    seconds, nanoseconds = np.divmod(stamp_ns, 1_000_000_000)
    messages[:, 4:8] = _bytes(seconds, "<i4")
    messages[:, 8:12] = _bytes(nanoseconds, "<u4")
    for from_end, columns in _places(topic.channel):
        start = messages.shape[1] - from_end
        numbers = values[:, columns]
        messages[:, start : start + 8 * numbers.shape[1]] = _bytes(numbers, "<f8")
    return messages


def _bytes(numbers: NDArray[Any], kind: str) -> NDArray[np.uint8]:
    columns = np.ascontiguousarray(numbers.reshape(len(numbers), -1), dtype=kind)
    return columns.view(np.uint8)


def _places(channel: str) -> tuple[tuple[int, slice], ...]:
    """Where columns of a channel go: bytes from the message's end, columns."""
    doubles: dict[str, tuple[tuple[int, slice], ...]] = {
        "tension": ((4, slice(0, 1)),),
        "exciter_force": ((6, slice(0, 3)),),
        "imu": ((24, slice(0, 3)), (12, slice(3, 6))),
        "inclination": ((3, slice(0, 2)),),
        "mocap": ((7, slice(0, 7)),),
        "ground_truth": ((85, slice(0, 7)), (42, slice(7, 13))),
    }
    if (
        channel == "exciter_shaft"
    ):  # angle, then length and padding of the next sequence, rate, length of effort
        return (28, slice(0, 1)), (12, slice(1, 2))
    return tuple((8 * count, columns) for count, columns in doubles[channel])


def _template(topic: Topic) -> Any:
    """A message with every field set that does not change."""
    make: Callable[..., Any] = _type
    time = make("builtin_interfaces/msg/Time", sec=0, nanosec=0)
    frame = f"{topic.cable}_load_cell" if topic.cable else _DEVICE_FRAMES[topic.channel]
    header = make("std_msgs/msg/Header", stamp=time, frame_id=frame)
    zero = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    if topic.channel in ("tension", "exciter_force"):
        unmeasured = make("geometry_msgs/msg/Vector3", x=np.nan, y=np.nan, z=np.nan)
        force = unmeasured if topic.channel == "tension" else zero
        wrench = make("geometry_msgs/msg/Wrench", force=force, torque=unmeasured)
        return make(topic.message_type, header=header, wrench=wrench)
    if topic.channel == "exciter_shaft":
        one, none = np.zeros(1), np.zeros(0)
        return make(
            topic.message_type, header=header, name=["shaft"], position=one, velocity=one, effort=none
        )
    if topic.channel == "inclination":
        return make(topic.message_type, header=header, vector=zero)
    turn = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    if topic.channel == "imu":
        unknown, no_orientation = np.zeros(9), np.array([-1.0] + 8 * [0.0])
        return make(
            topic.message_type, header=header, orientation=turn, orientation_covariance=no_orientation,
            angular_velocity=zero, angular_velocity_covariance=unknown,
            linear_acceleration=zero, linear_acceleration_covariance=unknown,
        )  # fmt: skip
    point = make("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
    pose = make("geometry_msgs/msg/Pose", position=point, orientation=turn)
    if topic.channel == "mocap":
        return make(topic.message_type, header=header, pose=pose)
    exact = np.zeros(36)
    twist = make("geometry_msgs/msg/Twist", linear=zero, angular=zero)
    return make(
        topic.message_type, header=header, child_frame_id="body",
        pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=exact),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=exact),
    )  # fmt: skip


def _type(message_type: str, /, **fields: Any) -> Any:
    return TYPESTORE.types[message_type](**fields)
