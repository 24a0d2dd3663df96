"""``preprocessor``: generalized wrench about the centre of mass, body axes, and how well it is known."""

from __future__ import annotations

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import InertiaStamped, WrenchStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import Float64MultiArray, Header

from rig_identification.live.common_time import CommonTime
from rig_identification.live.generalized_wrench import generalized_wrench
from rig_identification.live.known_body import KnownBody
from rig_identification.live.stamp_gate import StampGate
from rig_identification.live.wrench_uncertainty import wrench_uncertainty
from rig_identification.nodes.intake import Intake
from rig_identification.nodes.odometry_wire import read_odometry
from rig_identification.nodes.parameters import OwnParameter, within
from rig_identification.nodes.rig_node import LATCHED, OK, WARN, RigNode, diagnostic, reliable
from rig_identification.nodes.wire import Array, StampedDoubles, Stamps
from rig_identification.topics import expected_topics

PARAMETERS = (
    OwnParameter(
        "center_of_mass", [0.0], "m, body frame; one number: the identifier's latest, before it a guess"
    ),
    OwnParameter(
        "center_of_mass_std", [0.0], "m, of a center_of_mass that is given", within(0.0, 100.0, "m")
    ),
    OwnParameter("std_rate", 10.0, "Hz of generalized_wrench_std; 0: none", within(0.0, 100.0, "Hz")),
    OwnParameter("include_weight", True, "gravity is part of the force"),
    OwnParameter("period", 0.01, "s between looks at what arrived", within(0.001, 0.5, "s")),
    OwnParameter("depth", 2000, "messages kept of each topic: seconds of the fastest", within(10, 100_000)),
)
_POSE, _EXCITER = "pose", "exciter"


class PreprocessorNode(RigNode):
    """Brings tensions, exciter force and pose to common instants and publishes the wrench."""

    def __init__(self) -> None:
        super().__init__("preprocessor", PARAMETERS)
        self._description = rig = self.rig()
        given = self.own.vector("center_of_mass")
        center = given if given.size == 3 else None
        self.body = KnownBody(rig, center, self.own.vector("center_of_mass_std", 3))
        names = tuple(cable.name for cable in rig.cables)
        used = ("tension", "exciter_force") if rig.exciter is not None else ("tension",)
        topics = expected_topics(names, self.get_namespace())
        depth = self.own.whole("depth")
        self.intake = Intake(self, {n: t for n, t in topics.items() if t.channel in used}, depth)
        widths = {_POSE: 7, **dict.fromkeys(names, 1), **({_EXCITER: 3} if rig.exciter is not None else {})}
        self._common = CommonTime(widths)
        self._gate = StampGate()
        self._poses: list[bytes] = []
        self.create_subscription(Odometry, "odometry", self._poses.append, reliable(depth), raw=True)
        self.create_subscription(
            InertiaStamped, "identifier/inertia", self.guarded(self._hear_inertia), LATCHED
        )
        self.create_subscription(
            Float64MultiArray, "identifier/covariance", self.guarded(self._hear_covariance), LATCHED
        )
        self._writer = StampedDoubles(WrenchStamped(header=Header(frame_id="center_of_mass")), 6)
        self._wrench = self.create_publisher(WrenchStamped, "generalized_wrench", reliable(depth))
        self._std = self.create_publisher(WrenchStamped, "generalized_wrench_std", reliable(100))
        self._std_slot = 0  # of the last instant looked at: its time in steps of std_rate
        self.published = 0
        self.every(self.own.number("period"), self._work)

    def _hear_inertia(self, message: InertiaStamped) -> None:
        com = message.inertia.com
        self.body.identified(message.inertia.m, np.array([com.x, com.y, com.z]))

    def _hear_covariance(self, message: Float64MultiArray) -> None:
        self.body.doubted(np.reshape(message.data, (10, 10)))

    def _work(self) -> None:
        for batch in self.intake.take():
            name = batch.topic.cable or _EXCITER
            if len(batch.stamp_ns):
                self._common.add(name, batch.stamp_ns, batch.values)
        if self._poses:
            taken = self._poses[:]
            del self._poses[: len(taken)]
            stamps, values = read_odometry(taken)
            admitted = self._gate.admit(stamps, stamps)
            if admitted.any():
                self._common.add(_POSE, stamps[admitted], values[admitted, :7])
        stamps, values_at = self._common.take(_POSE)
        if not len(stamps):
            return
        tension = np.concatenate([values_at[cable.name] for cable in self._description.cables], axis=1)
        force = values_at.get(_EXCITER, np.zeros((len(stamps), 3)))
        center, weight = self.body.center, self._weight(self.body.mass)
        wrench = generalized_wrench(self._description, values_at[_POSE], tension, force, center, weight)
        for message in self._writer.serialize(stamps, wrench):
            self._wrench.publish(message)
        self.published += len(stamps)
        for k in self._due(stamps):
            self._publish_std(stamps[k : k + 1], values_at[_POSE][k], tension[k], force[k])

    def _due(self, stamps: Stamps) -> list[int]:
        """Instants at which deviations are due: by the stamps, in however large batches they come."""
        rate = self.own.number("std_rate")
        if rate <= 0.0:
            return []
        slots = stamps // round(1e9 / rate)
        due = np.flatnonzero(np.diff(slots, prepend=self._std_slot))
        self._std_slot = int(slots[-1])
        return [int(k) for k in due]

    def _weight(self, mass: float) -> float:
        """N, as far as it is part of the force."""
        return mass * self._description.gravity if self.own.flag("include_weight") else 0.0

    def _publish_std(self, stamp: Stamps, pose: Array, tension: Array, force: Array) -> None:
        """Standard deviations of one instant's wrench: they change slowly, and cost more than it does."""
        body = self.body
        found = wrench_uncertainty(
            self._description, pose, tension, force, body.center, body.center_std,
            self._weight(body.mass), self._weight(body.mass_std),
        )  # fmt: skip
        (message,) = self._writer.serialize(stamp, found.std[None])
        self._std.publish(message)

    def status(self) -> list[DiagnosticStatus]:
        """Where the centre of mass is from, and instants without a full set of values."""
        lost = self._common.given_up
        line = diagnostic(
            f"{self.get_name()}: wrench", WARN if lost else OK,
            f"{lost} instants lack a device's value" if lost else f"centre of mass: {self.body.center_from}",
            published=self.published, center_of_mass=np.round(self.body.center, 4).tolist(),
            mass=self.body.mass,
        )  # fmt: skip
        return [*super().status(), line]


def create() -> PreprocessorNode:
    """The node."""
    return PreprocessorNode()
