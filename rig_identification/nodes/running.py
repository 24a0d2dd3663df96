"""The running estimate beside the identifier: tracked motion and measured forces to J so far."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import InertiaStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64MultiArray

from rig_identification.live.common_time import CommonTime
from rig_identification.live.running_inertia import RunningInertia
from rig_identification.live.stamp_gate import StampGate
from rig_identification.nodes.intake import Batch
from rig_identification.nodes.odometry_wire import read_odometry
from rig_identification.nodes.result_messages import inertia_of, matrix_message
from rig_identification.nodes.rig_node import RigNode, reliable
from rig_identification.rig import Rig

_MOTION, _EXCITER = "motion", "exciter"
#: Poses are used this often, Hz: the body moves below 3 Hz.
_RATE = 100.0


class RunningEstimator:
    """Feeds a :class:`RunningInertia` while a dynamic window is open, and publishes what it says."""

    def __init__(self, node: RigNode, rig: Rig, rate: float) -> None:
        self._node, self._rig = node, rig
        self._on = False
        self._inertia = node.create_publisher(InertiaStamped, "~/running_inertia", 10)
        self._covariance = node.create_publisher(Float64MultiArray, "~/running_covariance", 10)
        self._odometry: list[bytes] = []
        self.forget()
        if rate > 0.0:
            node.create_subscription(Odometry, "odometry", self._gather, reliable(2000), raw=True)
            node.every(1.0 / rate, self._publish)

    def forget(self) -> None:
        """Start anew."""
        self.estimate = RunningInertia(self._rig)
        self._restart()

    def _restart(self) -> None:
        widths = {_MOTION: 13, **{cable.name: 1 for cable in self._rig.cables}}
        if self._rig.exciter is not None:
            widths[_EXCITER] = 3
        self._common = CommonTime(widths, longest=5.0)
        self._gate = StampGate()
        self._last_ns = 0
        self._odometry.clear()

    def listen(self, on: bool) -> None:
        """Take in what comes from now on, or stop."""
        self._on = on
        self._restart()

    def _gather(self, message: bytes) -> None:
        if self._on:
            self._odometry.append(message)

    def add(self, batch: Batch) -> None:
        """Samples of a force channel."""
        if self._on and len(batch.stamp_ns) and batch.topic.channel in ("tension", "exciter_force"):
            self._common.add(batch.topic.cable or _EXCITER, batch.stamp_ns, batch.values)

    def _publish(self) -> None:
        if not self._on:
            return
        self._take_motion()
        stamps, values = self._common.take(_MOTION)
        if len(stamps):
            tension = np.concatenate([values[cable.name] for cable in self._rig.cables], axis=1)
            force = values.get(_EXCITER, np.zeros((len(stamps), 3)))
            self.estimate.add(stamps, values[_MOTION], tension, force)
        estimate = self.estimate.estimate()
        if estimate is not None:
            stamp = self._node.get_clock().now().to_msg()
            self._inertia.publish(inertia_of(estimate.elements, stamp))
            self._covariance.publish(matrix_message(estimate.covariance))

    def _take_motion(self) -> None:
        messages, self._odometry = self._odometry, []
        if not messages:
            return
        stamps, values = read_odometry(messages)
        admitted = self._gate.admit(stamps, stamps)
        stamps, values = stamps[admitted], values[admitted]
        slots = stamps // round(1e9 / _RATE)
        first = np.flatnonzero(np.diff(slots, prepend=self._last_ns) > 0)
        if len(first):
            self._last_ns = int(slots[first[-1]])
            self._common.add(_MOTION, stamps[first], values[first])
