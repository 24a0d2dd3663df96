"""``tracker``: the body's pose and velocity at IMU rate, and the rig as markers."""

from __future__ import annotations

from collections import deque

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from visualization_msgs.msg import MarkerArray

from rig_identification.live.body_tracker import BodyTracker
from rig_identification.live.machine_code import compile_tracker
from rig_identification.live.tracked import Tracked
from rig_identification.nodes.intake import Intake
from rig_identification.nodes.markers import rig_markers
from rig_identification.nodes.odometry_wire import OdometryWriter
from rig_identification.nodes.parameters import OwnParameter, within
from rig_identification.nodes.rig_node import ERROR, OK, WARN, RigNode, diagnostic, reliable
from rig_identification.nodes.transforms import Transforms
from rig_identification.topics import expected_topics

PARAMETERS = (
    OwnParameter("integrate_only", False, "plain integration of the IMU from rest: nothing holds it"),
    OwnParameter("period", 0.004, "s between looks at what arrived", within(0.001, 0.1, "s")),
    OwnParameter("depth", 2000, "messages kept of each topic: seconds of the fastest", within(10, 100_000)),
    OwnParameter("marker_rate", 10.0, "Hz of the markers; 0: none", within(0.0, 60.0, "Hz")),
    OwnParameter("tf_rate", 50.0, "Hz of the body's transform on /tf; 0: none", within(0.0, 200.0, "Hz")),
)
#: Forces change the track slowly: they are looked at once in so many times.
FORCES_EVERY = 5
_PROMPT = ("imu", "inclination")
#: s from a sample's arrival after which its odometry is late; the latest 1 % may be.
LATE = 0.02
_USED = ("tension", "exciter_force", "imu", "inclination")


class TrackerNode(RigNode):
    """Feeds samples to the tracker and publishes what it says."""

    def __init__(self) -> None:
        super().__init__("tracker", PARAMETERS)
        self._description = self.rig()
        self.tracker = BodyTracker(self._description, self.own.flag("integrate_only"))
        names = tuple(cable.name for cable in self._description.cables)
        topics = expected_topics(names, self.get_namespace())
        used = {name: topic for name, topic in topics.items() if topic.channel in _USED}
        depth = self.own.whole("depth")
        self.intake = Intake(self, used, depth)
        self._prompt = [name for name, topic in used.items() if topic.channel in _PROMPT]
        self._looks = 0
        self._writer = OdometryWriter()
        self._odometry = self.create_publisher(Odometry, "odometry", reliable(depth))
        self._markers = self.create_publisher(MarkerArray, "markers", 10)
        self._tension: dict[str, float] = {}
        self._latest: Tracked | None = None
        self._silent_tension: list[str] = []
        self.latency: deque[float] = deque(maxlen=20_000)  # s, from an IMU sample's arrival to its odometry
        self._found_anew = 0  # times, by the last look
        self.tracked = self.late = 0  # samples since the start; those whose odometry came later than LATE
        self.every(self.own.number("period"), self._work)
        self._transforms = Transforms(self, self._description)
        if self.own.number("tf_rate") > 0.0:
            self.every(1.0 / self.own.number("tf_rate"), lambda: self._transforms.publish(self._latest))
        if self.own.number("marker_rate") > 0.0:
            self.every(1.0 / self.own.number("marker_rate"), self._draw)

    def _work(self) -> None:
        imu = None
        self._looks += 1
        for batch in self.intake.take(None if self._looks % FORCES_EVERY == 0 else self._prompt):
            channel = batch.topic.channel
            if channel == "imu":
                imu = batch
            elif channel == "inclination":
                self.tracker.add_inclination(batch.stamp_ns, batch.values)
            elif channel == "exciter_force":
                self.tracker.add_exciter(batch.stamp_ns, batch.values)
            elif batch.topic.cable is not None and len(batch.values):
                self.tracker.add_tension(batch.topic.cable, batch.stamp_ns, batch.values)
                self._tension[batch.topic.cable] = float(batch.values[-1, 0])
        if imu is None or not len(imu.stamp_ns):
            return
        tracked = self.tracker.add_imu(imu.stamp_ns, imu.values)
        if not np.all(np.isfinite(tracked.pose)):
            self.tracker = BodyTracker(self._description, self.own.flag("integrate_only"))
            self.fault("the motion could not be followed: tracking starts anew")
            return
        for message in self._writer.serialize(tracked):
            self._odometry.publish(message)
        self._latest = tracked
        latency = (self.intake.now_ns() - imu.arrival_ns) / 1e9
        self.latency.extend(latency.tolist())
        self.tracked += latency.size
        self.late += int(np.count_nonzero(latency > LATE))

    def _draw(self) -> None:
        if self._latest is None:
            return
        stamp = self.get_clock().now().to_msg()
        pose: NDArray[np.float64] = self._latest.pose[-1]
        self._markers.publish(rig_markers(self._description, pose, self._tension, stamp))

    def status(self) -> list[DiagnosticStatus]:
        """Latency, and what is not held."""
        name = f"{self.get_name()}: tracking"
        if self._latest is None or self.intake.silence(self._imu_topic()) > 1.0:
            line = diagnostic(name, ERROR, "no IMU samples: the body is not tracked")
        else:
            latency = np.array(self.latency)
            std = float(np.sqrt(np.max(np.linalg.eigvalsh(self._latest.pose_covariance[-1, :3, :3]))))
            found_anew = self.tracker.surprises + self.tracker.restarts
            level, message = OK, f"position to {1e3 * std:.1f} mm"
            if found_anew != self._found_anew:
                level, message = WARN, f"{message}; the body was lost a moment ago and found anew"
            self._found_anew = found_anew
            line = diagnostic(
                name, level, message,
                latency_p50_ms=f"{1e3 * np.percentile(latency, 50):.2f}",
                latency_p99_ms=f"{1e3 * np.percentile(latency, 99):.2f}",
                tracked=self.tracked, late=self.late, restarts=self.tracker.restarts,
                surprises=self.tracker.surprises,
            )  # fmt: skip
        frames = diagnostic(f"{self.get_name()}: frames", OK, self._transforms.told)
        return [*super().status(), line, frames]

    def _imu_topic(self) -> str:
        return next(name for name, topic in self.intake.topics.items() if topic.channel == "imu")


#: Compiled before the node is made.
prepare = compile_tracker


def create() -> TrackerNode:
    """The node."""
    return TrackerNode()
