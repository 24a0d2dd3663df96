"""The identifier's typed services, its action, and the latest body with its covariance in one message.

Names under ``~/typed/``: a service of one name has one type, and the Trigger services stay.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rclpy.time import Time
from rig_identification_interfaces.msg import InertiaWithCovariance
from rig_identification_interfaces.srv import Check, GetCenterOfMass, GetInertia, StartWindow, StopWindow

from rig_identification.errors import InputError
from rig_identification.nodes.deferred import Later
from rig_identification.nodes.identify_action import IdentifyAction
from rig_identification.nodes.recording_parameters import plan_of
from rig_identification.nodes.rig_node import LATCHED
from rig_identification.nodes.session_folder import RecordingPlan
from rig_identification.nodes.typed import TYPED
from rig_identification.nodes.typed_messages import body_message, finding_message, point, unknown_body
from rig_identification.nodes.worker_process import WorkerProcess

if TYPE_CHECKING:
    from rig_identification.nodes.identifier import IdentifierNode


class TypedServices:
    """Converts requests, calls the node, converts answers."""

    def __init__(self, node: IdentifierNode) -> None:
        self.told = TYPED
        self._node = node
        self._check: tuple[WorkerProcess, Later, Check.Response] | None = None
        self._body = node.create_publisher(InertiaWithCovariance, "~/body", LATCHED)
        node.serve_typed(GetInertia, "~/typed/get_inertia", self._get_inertia)
        node.serve_typed(GetCenterOfMass, "~/typed/get_center_of_mass", self._get_center_of_mass)
        node.serve_typed(StartWindow, "~/typed/start_window", self._start_window)
        node.serve_typed(StopWindow, "~/typed/stop_window", self._stop_window)
        node.serve_typed(Check, "~/typed/check", self._begin_check)
        self._action = IdentifyAction(node)

    # Latest answer

    def publish(self, latest: dict[str, Any]) -> None:
        """Publish the body."""
        self._body.publish(_body(latest, latest["result"]))

    def _get_inertia(self, request: GetInertia.Request, response: GetInertia.Response) -> str:
        response.body = response.without_frame = unknown_body()
        latest = self._node.latest()
        result = latest["result"]
        response.verdict = result["mismatch"]["verdict"]
        response.body = _body(latest, result)
        alone = result["without_frame"]
        response.has_frame = alone is not None
        if alone is not None:
            response.without_frame = _body(latest, alone)
        return ""

    def _get_center_of_mass(
        self, request: GetCenterOfMass.Request, response: GetCenterOfMass.Response
    ) -> str:
        nan = float("nan")
        response.mass = response.mass_std = nan
        response.center_of_mass.point = point(None)
        response.center_of_mass.header.frame_id = "body"
        response.covariance = [nan] * 9
        latest = self._node.latest()
        body = _body(latest, latest["result"])
        response.verdict = latest["result"]["mismatch"]["verdict"]
        response.mass, response.mass_std = body.inertia.m, body.covariance[0] ** 0.5
        response.center_of_mass.header = body.header
        com = body.inertia.com
        response.center_of_mass.point = point([com.x, com.y, com.z])
        response.covariance = [
            body.covariance[10 * row + column] for row in (1, 2, 3) for column in (1, 2, 3)
        ]
        response.unobservable = [name for name in body.unobservable if not name.startswith("J")]
        return ""

    # Windows

    def _start_window(self, request: StartWindow.Request, response: StartWindow.Response) -> str:
        at = request.dummy_position
        plan = plan_of(
            request.name, request.kind, request.holdout, request.dummy_mass, [at.x, at.y, at.z],
            self._node.taken_names(),
        )  # fmt: skip
        told = self._node.open_window(plan)
        response.name = plan.name
        return told

    def _stop_window(self, request: StopWindow.Request, response: StopWindow.Response) -> Later:
        def closed(plan: RecordingPlan, counts: dict[str, int], silent: list[str]) -> None:
            response.name, response.silent = plan.name, silent
            response.topics, response.messages = list(counts), list(counts.values())

        return self._node.close_window(closed)

    # Check

    def _begin_check(self, request: Check.Request, response: Check.Response) -> Later:
        if self._check is not None:
            raise InputError("a check is under way; wait for its answer")
        session, _ = self._node.chosen(request.session, list(request.windows))
        later = Later()
        self._check = WorkerProcess("check_program", str(session)), later, response
        return later

    def look(self) -> None:
        """Answer a check that is over."""
        if self._check is None or not self._check[0].look():
            return
        (process, later, response), self._check = self._check, None
        process.end()
        answer = process.answer or {}
        if answer["kind"] != "result":
            later.answer(False, str(answer.get("message", "the check was ended")))
            return
        faults = answer["check"]["faults"]
        response.faults = [finding_message(fault) for fault in faults]
        response.warnings = answer["check"]["warnings"]
        response.sound = not faults
        later.answer(True, f"{len(faults)} faults" if faults else "no fault was found")

    def close(self) -> None:
        """End a check, and withdraw the action."""
        if self._check is not None:
            self._check[0].end()
            self._check = None
        self._action.close()


def _body(latest: dict[str, Any], part: dict[str, Any]) -> InertiaWithCovariance:
    stamp = Time(nanoseconds=round(latest["stamp"] * 1e9)).to_msg()
    return body_message(part, stamp, latest["session_sha256"])
