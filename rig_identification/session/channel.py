"""One topic's serialized messages to a :class:`~rig_identification.raw.RawChannel`."""

from __future__ import annotations

from rig_identification.errors import InputError
from rig_identification.raw import RawChannel
from rig_identification.session.cdr import decode
from rig_identification.session.raw_topic import RawTopic
from rig_identification.topics import Topic

#: Columns of the decoded message that a channel uses.
_COLUMNS = {
    "tension": [2],
    "exciter_force": [0, 1, 2],
    "exciter_shaft": [0, 1],
    "imu": [0, 1, 2, 3, 4, 5],
    "inclination": [0, 1],
    "mocap": list(range(7)),
    "ground_truth": list(range(13)),
}


def raw_channel(raw: RawTopic, topic: Topic, where: str) -> RawChannel:
    """Decode one topic, whatever its stamps and numbers; ``where`` is the bag, for messages.

    Raises
    ------
    InputError
        Wrong message type, or a message that does not deserialize.
    """
    if raw.message_type != topic.message_type:
        raise InputError(
            f"{where}: {topic.name}: type is {raw.message_type}, not {topic.message_type}; "
            "record the contract's type or map the topic to another"
        )
    try:
        stamp_ns, decoded = decode(raw)
    except InputError as err:
        raise InputError(f"{where}: {err}") from err
    values = decoded[:, _COLUMNS[topic.channel]]
    return RawChannel(
        topic.name, topic.channel, topic.message_type, stamp_ns, raw.received_ns, values, topic.cable
    )
