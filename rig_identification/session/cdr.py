"""Fields of serialized messages, a column at a time.

Messages of one topic mostly share one layout: same length, same strings, same array lengths. Then a
field lies at the same offset in each, and one numpy view takes it from all. Where a layout varies, rosbags
deserializes each message.

Layout: OMG CORBA 3.4 part 2, section 9.3 (CDR); offsets are aligned from the end of the 4-byte
encapsulation header.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from rig_identification.errors import InputError
from rig_identification.session.raw_topic import Bytes, MessageBlock, RawTopic

Floats = NDArray[np.float64]
_ENCAPSULATION = 4
_TYPESTORE = get_typestore(Stores.ROS2_JAZZY)


class VaryingLayout(Exception):
    """Messages of one block do not share a layout."""


class Columns:
    """Reads the same field from all messages of a block, in the order of the message definition."""

    def __init__(self, data: Bytes) -> None:
        if data.shape[1] < _ENCAPSULATION or np.any(data[:, :2] != data[0, :2]):
            raise VaryingLayout
        identifier = bytes(data[0, :2])
        if identifier not in (b"\x00\x00", b"\x00\x01"):
            raise VaryingLayout
        self.count = len(data)
        self._data = data
        self._order = ">" if identifier == b"\x00\x00" else "<"
        self._offset = _ENCAPSULATION

    def _take(self, code: str, size: int, count: int) -> NDArray[Any]:
        start = self._offset + (_ENCAPSULATION - self._offset) % size
        end = start + size * count
        if end > self._data.shape[1]:
            raise VaryingLayout
        self._offset = end
        return np.ascontiguousarray(self._data[:, start:end]).view(f"{self._order}{code}{size}")

    def doubles(self, count: int) -> Floats:
        """(n, count) float64."""
        return self._take("f", 8, count).astype(np.float64)

    def skip_doubles(self, count: int) -> None:
        """Step over ``count`` float64."""
        self._offset += (_ENCAPSULATION - self._offset) % 8 + 8 * count

    def length(self) -> int:
        """Length word of a string or sequence, the same in every message."""
        words = self._take("u", 4, 1)
        if np.any(words != words[0, 0]):
            raise VaryingLayout
        return int(words[0, 0])

    def skip_string(self) -> None:
        """Step over a string."""
        length = self.length()
        self._offset += length

    def header(self) -> NDArray[np.int64]:
        """(n,) stamp of std_msgs/Header in ns."""
        seconds = self._take("i", 4, 1)[:, 0].astype(np.int64)
        nanoseconds = self._take("u", 4, 1)[:, 0].astype(np.int64)
        self.skip_string()
        return seconds * 1_000_000_000 + nanoseconds


def _first_double(columns: Columns) -> Floats:
    """(n, 1) first element of a float64 sequence, NaN where it is empty."""
    count = columns.length()
    return columns.doubles(count)[:, :1] if count else np.full((columns.count, 1), np.nan)


def _wrench(columns: Columns) -> Floats:
    return columns.doubles(6)


#: First element of a covariance whose quantity the device does not measure (sensor_msgs/msg/Imu).
_NOT_MEASURED = -1.0


def _imu(columns: Columns) -> Floats:
    columns.skip_doubles(4 + 9)
    rate, rate_covariance = columns.doubles(3), columns.doubles(9)
    force, force_covariance = columns.doubles(3), columns.doubles(9)
    rate[rate_covariance[:, 0] == _NOT_MEASURED] = np.nan
    force[force_covariance[:, 0] == _NOT_MEASURED] = np.nan
    return np.hstack((rate, force))


def _imu_message(message: Any) -> tuple[float, ...]:
    missing = (float("nan"),) * 3
    rate, force = _xyz(message.angular_velocity), _xyz(message.linear_acceleration)
    if message.angular_velocity_covariance[0] == _NOT_MEASURED:
        rate = missing
    if message.linear_acceleration_covariance[0] == _NOT_MEASURED:
        force = missing
    return rate + force


def _odometry(columns: Columns) -> Floats:
    columns.skip_string()
    pose = columns.doubles(7)
    columns.skip_doubles(36)
    return np.hstack((pose, columns.doubles(6)))


def _joint_state(columns: Columns) -> Floats:
    for _ in range(columns.length()):
        columns.skip_string()
    angle = _first_double(columns)
    return np.hstack((angle, _first_double(columns)))


def _xyz(vector: Any) -> tuple[float, ...]:
    return vector.x, vector.y, vector.z


def _pose(pose: Any) -> tuple[float, ...]:
    turn = pose.orientation
    return (*_xyz(pose.position), turn.x, turn.y, turn.z, turn.w)


def _first(sequence: Any) -> float:
    return float(sequence[0]) if len(sequence) else float("nan")


#: Message type -> (width, fields from columns, fields from one deserialized message).
_TYPES: dict[str, tuple[int, Callable[[Columns], Floats], Callable[[Any], tuple[float, ...]]]] = {
    "geometry_msgs/msg/WrenchStamped": (6, _wrench, lambda m: _xyz(m.wrench.force) + _xyz(m.wrench.torque)),
    "geometry_msgs/msg/Vector3Stamped": (3, lambda columns: columns.doubles(3), lambda m: _xyz(m.vector)),
    "geometry_msgs/msg/PoseStamped": (7, lambda columns: columns.doubles(7), lambda m: _pose(m.pose)),
    "geometry_msgs/msg/PointStamped": (3, lambda columns: columns.doubles(3), lambda m: _xyz(m.point)),
    "sensor_msgs/msg/Imu": (6, _imu, _imu_message),
    "std_msgs/msg/Float64": (1, lambda columns: columns.doubles(1), lambda m: (float(m.data),)),
    "nav_msgs/msg/Odometry": (
        13,
        _odometry,
        lambda m: _pose(m.pose.pose) + _xyz(m.twist.twist.linear) + _xyz(m.twist.twist.angular),
    ),
    "sensor_msgs/msg/JointState": (2, _joint_state, lambda m: (_first(m.position), _first(m.velocity))),
}

#: Types without a stamp of their own: the recorder's is the only one.
_WITHOUT_HEADER = frozenset({"std_msgs/msg/Float64"})


def decode(topic: RawTopic) -> tuple[NDArray[np.int64], Floats]:
    """Stamps and numbers of every message of a topic.

    Returns
    -------
    stamp_ns : (n,) int64
        ``header.stamp`` in ns, in the order of the file; when the recorder got it where a type has no header.
    values : (n, width) float64
        Wrench: force, torque. Vector3: x y z. Pose: position, quaternion xyzw. Imu: angular velocity, linear
        acceleration. Odometry: pose, twist (linear, angular). JointState: first position, first velocity.
        What an IMU marks as not measured is NaN.

    Raises
    ------
    InputError
        A message that does not deserialize.
    """
    width, by_columns, _ = _TYPES[topic.message_type]
    headless = topic.message_type in _WITHOUT_HEADER
    stamps = np.empty(topic.count, np.int64)
    values = np.empty((topic.count, width))
    for block in topic.blocks:
        try:
            columns = Columns(block.data)
            own = topic.received_ns[block.index] if headless else columns.header()
            stamps[block.index], values[block.index] = own, by_columns(columns)
        except VaryingLayout:
            stamps[block.index], values[block.index] = _decode_each(topic, block)
    return stamps, values


def _decode_each(topic: RawTopic, block: MessageBlock) -> tuple[list[int], list[tuple[float, ...]]]:
    """As :func:`decode` for a block of varying layout, by rosbags, message by message."""
    fields = _TYPES[topic.message_type][2]
    stamps, values = [], []
    for index, data in zip(block.index, block.data, strict=True):
        try:
            message: Any = _TYPESTORE.deserialize_cdr(data.tobytes(), topic.message_type)
        except Exception as err:
            raise InputError(
                f"{topic.name}: message {index} ({len(data)} bytes) is no {topic.message_type}; "
                "record the topic anew"
            ) from err
        if topic.message_type in _WITHOUT_HEADER:
            stamps.append(int(topic.received_ns[index]))
        else:
            stamps.append(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)
        values.append(fields(message))
    return stamps, values
