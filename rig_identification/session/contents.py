"""What the files of one bag hold: every topic as it is met, and the wanted ones' messages."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from rosbags.typesys import Stores, get_typestore

from rig_identification.errors import InputError
from rig_identification.session.raw_topic import Bytes, Collector, Integers, RawTopic
from rig_identification.session.unpacking import ZSTD_MAGIC, Damaged, unpacked_message

#: Encodings of messages that are read; a file that does not say is taken to hold CDR, and is found out.
_CDR, _ROS1 = ("cdr", ""), "ros1"
#: Topics of one bag. A graph of robots has hundreds; each costs memory in every table of the bag.
MOST_TOPICS = 10_000
#: Bytes of kept messages that any bag may have, and beyond them how many for each byte of its files: messages
#: that repeat themselves but for their stamps pack thirty to one.
_ALWAYS_KEPT, _KEPT_RATIO = 1 << 27, 40
_TYPESTORE = get_typestore(Stores.ROS2_JAZZY)

_Prepare = Callable[[bytes], bytes]


class Contents:
    """Filled file by file by the readers of storages.

    Parameters
    ----------
    where : Path
        The bag, for messages.
    wanted : collection of str
        Topics whose messages are kept; of the others messages are counted.
    """

    def __init__(self, where: Path, wanted: Collection[str]) -> None:
        self.listed: dict[str, str] = {}  # topic -> message type
        self.counts: dict[str, int] = {}  # topic -> messages met
        self._where = where
        self._wanted = wanted
        self._encoding: dict[str, str] = {}
        self._left = _ALWAYS_KEPT
        self._collector = Collector()

    def begin(self, file_size: int) -> None:
        """A file of so many bytes is read next."""
        self._left += _KEPT_RATIO * file_size

    def meet(self, topic: str, message_type: str, encoding: str) -> None:
        """Take note of a topic, as often as files name it.

        Raises
        ------
        InputError
            A topic of two types, or more topics than a bag has.
        """
        if len(self.listed) >= MOST_TOPICS and topic not in self.listed:
            raise InputError(
                f"{self._where}: names more than {MOST_TOPICS} topics; record the rig's own alone"
            )
        kind = _ros2_name(message_type)
        if self.listed.setdefault(topic, kind) != kind:
            raise InputError(f"{self._where}: {topic}: recorded with two types; keep one publisher")
        self.counts.setdefault(topic, 0)
        self._encoding[topic] = encoding

    def wants(self, topic: str) -> bool:
        """Whether the messages of ``topic`` are kept."""
        return topic in self._wanted

    def count(self, topic: str, messages: int) -> None:
        """Count messages that are not kept."""
        self.counts[topic] += messages

    def add(self, topic: str, received_ns: ArrayLike, messages: Sequence[bytes]) -> None:
        """Keep ``messages``. Raises Damaged, InputError."""
        if not messages:
            return
        prepare = self._prepare(topic, messages[0][:4])
        ready = list(map(prepare, messages)) if prepare else messages
        self._keep(sum(map(len, ready)))
        self._collector.add(topic, received_ns, ready)
        self.counts[topic] += len(messages)

    def add_slices(
        self,
        topic: str,
        received_ns: ArrayLike,
        buffer: Bytes,
        starts: list[int] | Integers,
        ends: list[int] | Integers,
    ) -> None:
        """Keep the messages ``buffer[start:end]``. Raises Damaged, InputError."""
        if self._prepare(topic, buffer[starts[0] : starts[0] + 4].tobytes()) is None:
            self._keep(int(np.sum(ends)) - int(np.sum(starts)))
            self._collector.add_slices(topic, received_ns, buffer, starts, ends)
            self.counts[topic] += len(starts)
            return
        raw = buffer.tobytes()
        self.add(topic, received_ns, [raw[a:b] for a, b in zip(starts, ends, strict=True)])

    def take(self, topic: str, message_type: str) -> RawTopic:
        """All messages of one topic; they are given up."""
        return self._collector.take(topic, message_type)

    def _keep(self, size: int) -> None:
        """Count bytes that are kept. Raises Damaged."""
        if size > self._left:
            raise Damaged("its messages unpack to more than such a file can hold")
        self._left -= size

    def _prepare(self, topic: str, beginning: bytes) -> _Prepare | None:
        """What makes CDR of a topic's messages, by its encoding and the first bytes of one."""
        encoding = self._encoding[topic]
        if encoding == _ROS1:
            return self._from_ros1(topic)
        if encoding not in _CDR:
            raise InputError(
                f"{self._where}: {topic}: messages are encoded as {encoding}, not cdr; record them from ROS, "
                "or leave the topic out of the bag"
            )
        # CDR begins with a zero byte.
        return unpacked_message if beginning == ZSTD_MAGIC else None

    def _from_ros1(self, topic: str) -> _Prepare:
        kind = self.listed[topic]
        if kind not in _TYPESTORE.types:  # no type of the contract, which is found out later
            return bytes

        def convert(message: bytes) -> bytes:
            try:
                return bytes(_TYPESTORE.ros1_to_cdr(message, kind))
            except Exception as err:  # generated code fails in as many ways as bytes can be wrong
                raise InputError(
                    f"{self._where}: {topic}: a message of {len(message)} bytes is no {kind}; "
                    "record the topic anew"
                ) from err

        return convert


def _ros2_name(message_type: str) -> str:
    """``sensor_msgs/msg/Imu`` of ROS 1's ``sensor_msgs/Imu``."""
    package, slash, name = message_type.partition("/")
    return f"{package}/msg/{name}" if slash and "/" not in name else message_type
