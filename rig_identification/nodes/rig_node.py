"""What every node of the rig shares: parameters, guarded callbacks, diagnostics, one way to end."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions
from rclpy.subscription import Subscription
from std_srvs.srv import Trigger

from rig_identification.errors import InputError, RigIdentificationError
from rig_identification.nodes.by_hand import ByHand
from rig_identification.nodes.deferred import Later, serve_later
from rig_identification.nodes.parameters import OwnParameter, OwnParameters
from rig_identification.nodes.rig_parameters import refuse_misspelt, rig_of
from rig_identification.rig import Rig

#: The latest message stays for those who come later.
LATCHED = QoSProfile(
    depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE
)
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


def reliable(depth: int) -> QoSProfile:
    """Reliable, the last ``depth`` messages kept: a second of a sensor's samples."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.RELIABLE)


def _ignore(message: bytes) -> None:
    """No executor hands this a message."""


class RigNode(Node):
    """A node that outlives its callbacks' errors and says so on ``/diagnostics``."""

    def __init__(self, name: str, parameters: Sequence[OwnParameter]) -> None:
        self._by_hand: list[ByHand] = []
        super().__init__(
            name,
            namespace=None,
            allow_undeclared_parameters=True,
            automatically_declare_parameters_from_overrides=True,
        )
        self._own_names = [p.name for p in parameters]
        refuse_misspelt(self, self._own_names)
        self.own = OwnParameters(self, parameters)
        self.steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.faults = 0  # errors that callbacks raised
        self.last_fault = ""
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.every(1.0, self._diagnose)

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Those that an executor serves."""
        apart = {id(one.subscription) for one in self._by_hand}
        yield from (one for one in super().subscriptions if id(one) not in apart)

    def subscribe_by_hand(self, kind: type, topic: str, qos: QoSProfile) -> ByHand:
        """A raw subscription whose messages wait until they are taken.

        Parameters ``qos_overrides.<topic>.subscription.*`` change its history, depth and reliability: a
        driver that sends best effort is not heard otherwise. Raises InputError for one that is none.
        """
        try:
            made = ByHand(
                self.create_subscription(
                    kind, topic, _ignore, qos, raw=True,
                    qos_overriding_options=QoSOverridingOptions.with_default_policies(),
                )
            )  # fmt: skip
        except (InvalidQosOverridesError, InvalidParameterTypeException, RuntimeError) as error:
            name = self.resolve_topic_name(topic)
            raise InputError(f"parameter qos_overrides.{name}.subscription: {error}; correct it") from error
        self._by_hand.append(made)
        return made

    def rig(self) -> Rig:
        """The rig that the parameters describe. Raises InputError."""
        return rig_of(self, self._own_names)

    def every(self, period: float, work: Callable[[], None], group: CallbackGroup | None = None) -> None:
        """Call ``work`` each ``period`` seconds of the machine's steady clock."""
        self.create_timer(period, self.guarded(work), clock=self.steady, callback_group=group)

    def guarded(self, work: Callable[..., None]) -> Callable[..., None]:
        """``work``, its errors logged and counted: one bad message must not end a node."""

        def call(*arguments: object) -> None:
            try:
                work(*arguments)
            except RigIdentificationError as error:
                self.fault(str(error))
            except Exception as error:
                self.fault(f"{type(error).__name__}: {error}", traceback.format_exc())

        return call

    def fault(self, message: str, details: str = "") -> None:
        """Log an error; the same one again is only counted."""
        self.faults += 1
        if message != self.last_fault:
            self.get_logger().error(f"{message}\n{details}".rstrip())
        self.last_fault = message

    def serve(self, name: str, answer: Callable[[], str | Later], group: CallbackGroup | None = None) -> None:
        """Offer a Trigger service; ``answer`` returns the message or what it will come by, or raises what
        the caller is told.
        """
        self.serve_typed(Trigger, name, lambda _, response: answer(), group)

    def serve_typed(
        self,
        kind: type,
        name: str,
        answer: Callable[[Any, Any], str | Later],
        group: CallbackGroup | None = None,
    ) -> None:
        """Offer a service whose responses hold ``success`` and ``message``, as :meth:`serve` does.

        answer: given request and response; it fills in whatever else the response holds.
        """

        def call(request: object, response: object) -> tuple[bool, str] | Later:
            success, message = self.outcome(lambda: answer(request, response))
            return message if isinstance(message, Later) else (success, message)

        serve_later(self, kind, name, call, group)

    def outcome(self, answer: Callable[[], str | Later]) -> tuple[bool, str | Later]:
        """(success, message or what it will come by) of a request."""
        try:
            return True, answer()
        except RigIdentificationError as error:
            return False, str(error)
        except Exception as error:
            self.fault(f"{type(error).__name__}: {error}", traceback.format_exc())
            return False, f"defect: {type(error).__name__}: {error}"

    def status(self) -> list[DiagnosticStatus]:
        """What the node says of itself each second; nodes add to it."""
        level, message = (
            (OK, "running") if not self.faults else (WARN, f"{self.faults} errors: {self.last_fault}")
        )
        names = self.get_node_names_and_namespaces()
        if names.count((self.get_name(), self.get_namespace())) > 1:
            level, message = ERROR, "two nodes of this name run: end one, or rename it"
        return [diagnostic(f"{self.get_name()}: node", level, message)]

    def _diagnose(self) -> None:
        array = DiagnosticArray(status=self.status())
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def close(self) -> None:
        """End what the node has begun: files, processes, threads. Called once, before it is destroyed."""


def diagnostic(name: str, level: bytes, message: str, **values: object) -> DiagnosticStatus:
    """One line of ``/diagnostics``."""
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(level=level, name=name, message=message, hardware_id="rig", values=pairs)
