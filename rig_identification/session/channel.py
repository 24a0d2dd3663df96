"""One topic's serialized messages to a :class:`~rig_identification.raw.RawChannel`."""

from __future__ import annotations

import numpy as np

from rig_identification.errors import InputError
from rig_identification.raw import Array, RawChannel
from rig_identification.session.cdr import decode
from rig_identification.session.raw_topic import RawTopic
from rig_identification.topics import POINT, POSE, Topic

#: Columns of the decoded message that a channel uses.
_COLUMNS = {
    "tension": [2],
    "exciter_force": [0, 1, 2],
    "exciter_shaft": [0, 1],
    "imu": [0, 1, 2, 3, 4, 5],
    "inclination": [0, 1],
    "ground_truth": list(range(13)),
}


def raw_channel(raw: RawTopic, topic: Topic, where: str) -> RawChannel:
    """Decode one topic, whatever its stamps and numbers; ``where`` is the bag, for messages.

    Raises
    ------
    InputError
        Wrong message type, or a message that does not deserialize.
    """
    if raw.message_type not in topic.message_types:
        raise InputError(
            f"{where}: {topic.name}: type is {raw.message_type}, not {' or '.join(topic.message_types)}; "
            "record the contract's type or map the topic to another"
        )
    try:
        stamp_ns, decoded = decode(raw)
    except InputError as err:
        raise InputError(f"{where}: {err}") from err
    if topic.channel == "mocap":
        values = _as_pose(raw.message_type, decoded)
    else:
        values = decoded[:, _COLUMNS[topic.channel]]
    return RawChannel(
        topic.name, topic.channel, raw.message_type, stamp_ns, raw.received_ns, values, topic.cable
    )


def _as_pose(message_type: str, decoded: Array) -> Array:
    """(n, 7) position and quaternion xyzw of what a tracker sends; NaN: not measured.

    A point is a marker without attitude. A number is the body's turn (rad) about the tracker's z, upwards.
    """
    if message_type == POSE:
        return decoded
    pose = np.full((decoded.shape[0], 7), np.nan)
    if message_type == POINT:
        pose[:, :3] = decoded
    else:
        pose[:, 5], pose[:, 6] = np.sin(0.5 * decoded[:, 0]), np.cos(0.5 * decoded[:, 0])
    return pose
