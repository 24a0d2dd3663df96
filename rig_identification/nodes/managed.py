"""A node with the states of a ROS 2 managed node: unconfigured, inactive, active, finalized.

Configuring opens the device, activating publishes. The node does both by itself when it starts, unless
``autostart`` is false: then a lifecycle manager or ``ros2 lifecycle set`` does.
"""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.lifecycle import LifecycleNodeMixin, TransitionCallbackReturn

from rig_identification.errors import RigIdentificationError
from rig_identification.nodes.parameters import OwnParameter
from rig_identification.nodes.rig_node import OK, RigNode, diagnostic

AUTOSTART = OwnParameter(
    "autostart", True, "configure and activate with the node; false: a lifecycle manager does"
)
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class ManagedNode(LifecycleNodeMixin, RigNode):  # type: ignore[misc]
    """What it holds is opened by configuring and given back by cleaning up; it speaks while it is active."""

    def __init__(self, name: str, parameters: Sequence[OwnParameter]) -> None:
        RigNode.__init__(self, name, (*parameters, AUTOSTART))
        self.active = False
        self.state = "unconfigured"
        self._refused: Exception | None = None
        LifecycleNodeMixin.__init__(self)
        self._guard_requests()

    def _guard_requests(self) -> None:
        """Refuse a transition that the state does not have: rclpy raises, which would end the executor."""
        service = self._service_change_state
        change = service.callback

        def answer(request: Any, response: Any) -> Any:
            try:
                return change(request, response)
            except Exception as error:
                self.fault(f"transition {request.transition.id}: {' '.join(str(error).split())}")
                response.success = False
                return response

        service.callback = answer

    def begin(self) -> None:
        """Start as ``autostart`` says; the end of a node's construction. Raises what :meth:`open` raises."""
        if not self.own.flag("autostart"):
            return
        self.trigger_configure()
        if self._refused is not None:
            raise self._refused
        self.trigger_activate()

    def open(self) -> None:
        """Open what the node needs. Raises InputError where that cannot be."""

    def shut(self) -> None:
        """Give back what :meth:`open` opened; it may have opened nothing."""

    def on_configure(self, state: Any) -> TransitionCallbackReturn:
        """Open; a refusal is logged, and leaves the node unconfigured."""
        _ = state
        self._refused = None
        try:
            self.open()
        except Exception as error:
            self._refused = error
            self.shut()
            if not self.own.flag("autostart"):
                known = isinstance(error, RigIdentificationError)
                self.fault(str(error) if known else repr(error), "" if known else traceback.format_exc())
            return FAILURE
        self.state = "inactive"
        return SUCCESS

    def on_activate(self, state: Any) -> TransitionCallbackReturn:
        """Speak."""
        _ = state
        self.active, self.state = True, "active"
        return SUCCESS

    def on_deactivate(self, state: Any) -> TransitionCallbackReturn:
        """Be silent."""
        _ = state
        self.active, self.state = False, "inactive"
        return SUCCESS

    def on_cleanup(self, state: Any) -> TransitionCallbackReturn:
        """Give back what was opened."""
        _ = state
        self.shut()
        self.active, self.state = False, "unconfigured"
        return SUCCESS

    def on_shutdown(self, state: Any) -> TransitionCallbackReturn:
        """Give back what was opened, for good; the process stays until it is told to end."""
        _ = state
        self.shut()
        self.active, self.state = False, "finalized"
        return SUCCESS

    def status(self) -> list[DiagnosticStatus]:
        """The state beside what every node says."""
        return [*super().status(), diagnostic(f"{self.get_name()}: state", OK, self.state)]

    def close(self) -> None:
        """Give back what was opened."""
        self.active = False
        self.shut()
