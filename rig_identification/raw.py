"""What a session's bags hold before anything is left out: frozen arrays, no files and no ROS.

The examination (``check/``) looks at these values and may correct them; cleaning them
(:func:`rig_identification.session.clean`) makes a :class:`~rig_identification.recording.Session`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.recording import Dummy
from rig_identification.rig import Rig

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class RawChannel:
    """Every message of one topic in the order of the file, whatever its stamp and its numbers."""

    topic: str  # name in the bag
    channel: str  # "tension", "imu", ...: a field of Recording
    message_type: str
    stamp_ns: Stamps  # (n,) header.stamp
    received_ns: Stamps  # (n,) when the recorder got it
    values: Array  # (n, width) columns of the channel as in Recording; NaN: not measured
    cable: str | None = None  # of a tension

    @property
    def device(self) -> str:
        """Contract word of the device: a cable's name, "imu", "inclinometer", "exciter" or "mocap"."""
        if self.cable is not None:
            return self.cable
        names = {"inclination": "inclinometer", "exciter_force": "exciter", "exciter_shaft": "exciter"}
        return names.get(self.channel, self.channel)


@dataclass(frozen=True)
class RawRecording:
    """One bag of a session."""

    name: str  # as in session.yaml
    kind: str  # "static" or "dynamic"
    holdout: bool
    where: str  # path of the bag, for messages
    channels: tuple[RawChannel, ...]  # the contract's topics that the bag holds
    listed: dict[str, str] = field(default_factory=dict)  # every topic of the bag -> its message type
    counts: dict[str, int] = field(default_factory=dict)  # every topic of the bag -> its messages
    dummy: Dummy | None = None
    notes: tuple[str, ...] = ()  # sentences on how the bag was read

    def channel(self, device: str, channel: str | None = None) -> RawChannel | None:
        """Channel of a device, the first where it has several and ``channel`` does not say which."""
        for one in self.channels:
            if one.device == device and channel in (None, one.channel):
                return one
        return None

    def with_channels(self, *changed: RawChannel) -> RawRecording:
        """The recording with each of ``changed`` in the place of the channel of its topic."""
        by_topic = {channel.topic: channel for channel in changed}
        return replace(self, channels=tuple(by_topic.get(c.topic, c) for c in self.channels))


@dataclass(frozen=True)
class RawSession:
    """One body on one rig on one day, as recorded."""

    name: str
    rig: Rig
    recordings: tuple[RawRecording, ...]
    namespace: str = "/rig"
    notes: tuple[str, ...] = ()
