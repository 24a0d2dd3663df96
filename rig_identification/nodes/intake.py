"""Raw subscriptions: serialized messages wait in the middleware and are taken in batches.

A Python callback that touches a message's fields costs more than the time between two of them
at 7000 a second; taking bytes does not. Taken by hand they come with the middleware's own stamps, which
the events executor of rclpy 7.1 cannot pass on (a callback for message and info raises SystemError).
"""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from rclpy.clock import ROSClock

from rig_identification.cleaning.clipping import clipped_samples
from rig_identification.errors import InputError
from rig_identification.live.sending_clock import SendingClock
from rig_identification.live.stamp_gate import StampGate
from rig_identification.nodes.by_hand import Taken
from rig_identification.nodes.rig_node import RigNode, reliable
from rig_identification.nodes.wire import TYPES, channel_values, decode_batch
from rig_identification.topics import Topic

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


#: Channels whose sensor has an end of range.
CAN_CLIP = ("tension", "exciter_force", "imu", "inclination")


@dataclass(frozen=True)
class Batch:
    """What arrived on one topic since the last look."""

    topic: Topic
    messages: list[bytes]  # all, as received
    arrival_ns: Stamps  # (n,) node clock
    sent_ns: Stamps  # (n,) this machine's clock
    stamp_ns: Stamps  # (k,) of the believable samples
    values: Array  # (k, w) finite where the sensor measured
    heard_ns: Stamps  # (n,) stamps of all, believable or not; none where a message does not deserialize
    heard: Array  # (n, w) their numbers

    def __len__(self) -> int:
        return len(self.messages)


class Intake:
    """Subscriptions to topics, with the account of each.

    Parameters
    ----------
    node : RigNode
    topics : mapping
        Name of the topic to what it carries.
    depth : int
        Messages that the middleware keeps for each topic until they are taken: a second's worth.
    watch_range : bool
        Keep samples for :meth:`look_for_clipping`, which must then be called each second.
    """

    def __init__(
        self, node: RigNode, topics: dict[str, Topic], depth: int, watch_range: bool = False
    ) -> None:
        self.topics = topics
        self.gates = {name: StampGate() for name in topics}
        self.not_finite = dict.fromkeys(topics, 0)
        self.garbled = dict.fromkeys(topics, 0)
        self.clipped = dict.fromkeys(
            topics, 0
        )  # samples stuck at the end of the range, looked at a second each
        self._recent: dict[str, list[Array]] = {name: [] for name in topics}
        self.last_arrival = dict.fromkeys(topics, 0.0)  # s, steady clock
        self._node, self._watch_range = node, watch_range
        self._sending = {name: SendingClock() for name in topics}
        # With simulated time, arrivals are taken on that clock: stamps of a fast replay outrun the wall's
        self._simulated = bool(node.get_parameter("use_sim_time").value)
        self._subscriptions = {
            name: node.subscribe_by_hand(TYPES[topic.message_type], name, reliable(depth))
            for name, topic in topics.items()
        }

    def now_ns(self) -> int:
        """The clock on which arrivals are taken."""
        if not self._simulated:
            return time.time_ns()
        clock = self._node.get_clock()
        assert isinstance(clock, ROSClock)
        return int(clock.now().nanoseconds)

    def take(self, names: Collection[str] | None = None) -> list[Batch]:
        """Everything that arrived since the last call on ``names`` (None: all); no news, no batch."""
        batches = []
        for name in self.topics if names is None else names:
            arrived = self._subscriptions[name].take()
            if arrived:
                self.last_arrival[name] = time.monotonic()
                batches.append(self._batch(name, arrived))
        return batches

    def _batch(self, name: str, arrived: list[Taken]) -> Batch:
        topic = self.topics[name]
        source, received = np.array([(one.source_ns, one.received_ns) for one in arrived], np.int64).T
        sent = self._sending[name].times(source, received)
        arrival = np.full(len(arrived), self.now_ns()) if self._simulated else received
        messages = [one.message for one in arrived]
        try:
            stamps, decoded = decode_batch(name, topic.message_type, messages)
        except InputError:
            self.garbled[name] += len(messages)
            stamps, decoded = np.zeros(0, np.int64), np.zeros((0, 6))
            values = channel_values(topic, decoded)
            return Batch(topic, messages, arrival, sent, stamps, values, stamps, values)
        admitted = self.gates[name].admit(stamps, arrival)
        values = channel_values(topic, decoded)
        finite = np.isfinite(values).all(axis=1)
        self.not_finite[name] += int(np.count_nonzero(admitted & ~finite))
        used = admitted & finite
        if self._watch_range and topic.channel in CAN_CLIP:
            self._recent[name].append(values[used])
        return Batch(topic, messages, arrival, sent, stamps[used], values[used], stamps, values)

    def look_for_clipping(self) -> None:
        """Count the clipped samples since the last call; called each second."""
        for name, pieces in self._recent.items():
            if pieces:
                self.clipped[name] += int(np.count_nonzero(clipped_samples(np.concatenate(pieces))))
                pieces.clear()

    def silence(self, name: str) -> float:
        """Seconds since the last message of a topic; infinite before the first."""
        last = self.last_arrival[name]
        return time.monotonic() - last if last else float("inf")
