"""``rig_simulator``: the plant that simulated sensor nodes sample, in real time or faster."""

from __future__ import annotations

import time

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock as ClockMessage
from std_msgs.msg import Float64MultiArray

from rig_identification.errors import InputError
from rig_identification.live.machine_code import compile_plant
from rig_identification.live.plant import Plant, Shaking, odometry_values
from rig_identification.live.plant_effects import with_effects
from rig_identification.live.plant_switches import effects_of, switches
from rig_identification.model.body import can_exist
from rig_identification.model.motion import Motion, rig_model
from rig_identification.nodes.parameters import OwnParameter, within
from rig_identification.nodes.plant_message import TOPIC, to_message
from rig_identification.nodes.rig_node import OK, WARN, RigNode, diagnostic, reliable
from rig_identification.recording import Dummy
from rig_identification.session.messages import serialize
from rig_identification.topics import expected_topics

#: Effects that the plant can have; those of the devices are the sensor nodes' own parameters.
EFFECTS = tuple(
    OwnParameter(
        f"effect.{switch.name}",
        list(switch.default) if isinstance(switch.default, tuple) else switch.default,
        switch.meaning,
        within(switch.low, switch.high, switch.unit),
    )
    for switch in switches()
)
PARAMETERS = (
    OwnParameter("speed", 1.0, "simulated seconds a second", within(0.01, 100.0)),
    OwnParameter(
        "publish_clock", False, "publish /clock, for nodes with use_sim_time; needed where speed is not 1"
    ),
    OwnParameter("ground_truth_rate", 100.0, "Hz of ground_truth/odometry", within(0.1, 1000.0, "Hz")),
    OwnParameter("body.mass", 1000.0, "kg, body and frame together", within(0.1, 1e6, "kg")),
    OwnParameter("body.center_of_mass", [1.0, 1.0, -0.5], "m, body frame", within(-100.0, 100.0, "m")),
    OwnParameter(
        "body.inertia", [500.0, 0.0, 0.0, 500.0, 0.0, 500.0], "xx xy xz yy yz zz, kg m^2, about the centre"
    ),
    OwnParameter(
        "shake.amplitude", [100.0, 100.0, 0.0], "N on each axis of the exciter frame", settable=True
    ),
    OwnParameter(
        "shake.frequency", [0.5, 0.7, 1.0], "Hz of each axis", within(0.01, 20.0, "Hz"), settable=True
    ),
    OwnParameter("shake.at_start", False, "shake from the beginning"),
    OwnParameter(
        "dummy.mass", 0.0, "kg fixed to the body at the next ~/come_to_rest", within(0, 1e6), settable=True
    ),
    OwnParameter(
        "dummy.position", [0.0, 0.0, 0.0], "m, body frame", within(-100.0, 100.0, "m"), settable=True
    ),
    *EFFECTS,
)
#: Wall seconds between two blocks.
TICK = 0.01
#: Simulated seconds that one tick makes up for at most.
CATCH_UP = 0.25


class RigSimulator(RigNode):
    """Publishes blocks of the plant, ground truth and, where asked for, the clock."""

    def __init__(self) -> None:
        super().__init__("rig_simulator", PARAMETERS)
        rig = self.rig()
        if self.own.number("speed") != 1.0 and not self.own.flag("publish_clock"):
            raise InputError(
                "parameter publish_clock: a speed other than 1 needs the simulated clock; set it true"
            )
        self.plant = self._make_plant()
        self._blocks = self.create_publisher(Float64MultiArray, TOPIC, reliable(200))
        self._truth = self.create_publisher(Odometry, "ground_truth/odometry", reliable(1000))
        names = tuple(cable.name for cable in rig.cables)
        self._truth_topic = expected_topics(names, namespace="")["/ground_truth/odometry"]
        self._time_topic = (
            self.create_publisher(ClockMessage, "/clock", 10) if self.own.flag("publish_clock") else None
        )
        self._truth_due = 0
        self._begun = time.monotonic()
        self.lost = 0.0  # s that the simulation fell behind
        if self.own.flag("shake.at_start"):
            self.plant.shake(self._shaking())
        self.every(TICK, self._tick)
        self.serve("~/shake", self._shake)
        self.serve("~/stop_shaking", self._stop_shaking)
        self.serve("~/come_to_rest", self._come_to_rest)

    def _make_plant(self) -> Plant:
        rig = self.rig()
        inertia = self.own.vector("body.inertia", 6)
        elements = np.concatenate(
            [[self.own.number("body.mass")], self.own.vector("body.center_of_mass", 3), inertia]
        )
        if not can_exist(elements):
            raise InputError(
                f"parameter body.inertia: no body has {inertia.tolist()} kg m^2; order is xx xy xz yy yz zz"
            )
        model = rig_model(rig, elements)
        switched = {switch.name: self.own.vector(f"effect.{switch.name}") for switch in switches()}
        effects = effects_of(switched, model, "parameter effect.")
        return Plant(with_effects(model, effects), time.time_ns(), push=effects.push)

    def _shaking(self) -> Shaking:
        return Shaking(self.own.vector("shake.amplitude", 3), self.own.vector("shake.frequency", 3))

    def _shake(self) -> str:
        self.plant.shake(self._shaking())
        return "shaking"

    def _stop_shaking(self) -> str:
        self.plant.stop_shaking()
        return "the exciter stands; the body swings on"

    def _come_to_rest(self) -> str:
        mass = self.own.number("dummy.mass")
        self.plant.come_to_rest(Dummy(mass, self.own.vector("dummy.position", 3)) if mass > 0.0 else None)
        # Samples on their way to a listener are from before: their stamps tell
        since = f"from stamp {self.plant.now_ns / 1e9:.6f} on"
        return f"at rest with a dummy of {mass:g} kg {since}" if mass > 0.0 else f"at rest {since}"

    def _tick(self) -> None:
        behind = self.own.number("speed") * (time.monotonic() - self._begun) - 0.001 * self.plant.nodes
        if behind > CATCH_UP:
            self._begun += (behind - CATCH_UP) / self.own.number("speed")
            self.lost += behind - CATCH_UP
            behind = CATCH_UP
        if behind < 0.001:
            return
        block, motion = self.plant.advance(behind)
        if self._time_topic is not None:
            seconds, nanoseconds = divmod(self.plant.now_ns, 1_000_000_000)
            message = ClockMessage()
            message.clock.sec, message.clock.nanosec = seconds, nanoseconds
            self._time_topic.publish(message)
        self._blocks.publish(to_message(block))
        self._publish_truth(block.start_ns, motion)

    def _publish_truth(self, start_ns: int, motion: Motion) -> None:
        every = max(1, round(1000.0 / self.own.number("ground_truth_rate")))
        nodes = motion.states.shape[0] - 1
        first = self.plant.nodes - nodes
        for node in range((-first) % every, nodes, every):
            stamp = np.array([start_ns + node * 1_000_000], np.int64)
            row = serialize(self._truth_topic, stamp, odometry_values(motion, node)[None])
            self._truth.publish(row[0].tobytes())

    def status(self) -> list[DiagnosticStatus]:
        """Whether the simulation keeps its pace."""
        slow = self.lost > 1.0
        message = f"{self.lost:.1f} s behind: lower speed or rates" if slow else "keeps its pace"
        line = diagnostic(
            f"{self.get_name()}: pace", WARN if slow else OK, message, simulated=0.001 * self.plant.nodes
        )
        return [*super().status(), line]


#: Compiled before the node is made.
prepare = compile_plant


def create() -> RigSimulator:
    """The node."""
    return RigSimulator()
