"""The action ``~/identify_inertia``: a fit with its progress and its numbers until now, to be cancelled."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.task import Future
from rclpy.time import Time
from rig_identification_interfaces.action import IdentifyInertia

from rig_identification.errors import InputError, RigIdentificationError
from rig_identification.nodes.fits import Job
from rig_identification.nodes.typed_messages import body_message, finding_message, unknown_body

if TYPE_CHECKING:
    from rig_identification.nodes.identifier import IdentifierNode

NAME = "identify_inertia"


class Goal:
    """A goal that waits for its fit."""

    def __init__(self, handle: ServerGoalHandle) -> None:
        self._handle = handle
        #: The state that the goal ends in, and its result.
        self.ended: Future[tuple[str, IdentifyInertia.Result]] = Future()

    def hear(self, stage: str, fraction: float, numbers: dict[str, Any] | None) -> None:
        """Publish how far the fit is."""
        known = unknown_body() if numbers is None else body_message(numbers, Time().to_msg(), "")
        self._handle.publish_feedback(IdentifyInertia.Feedback(stage=stage, fraction=fraction, so_far=known))

    def answer(self, latest: dict[str, Any]) -> None:
        """End with the answer; one that was interrupted is the best until then."""
        state = "canceled" if latest["interrupted"] else "succeed"
        self.ended.set_result((state, result_message(latest)))

    def fail(self, message: str) -> None:
        """End without an answer."""
        state = "canceled" if self._handle.is_cancel_requested else "abort"
        self.ended.set_result((state, IdentifyInertia.Result(message=message, body=unknown_body())))


class IdentifyAction:
    """One goal at a time: a fit keeps both cores busy. A second goal is aborted, and told what runs."""

    def __init__(self, node: IdentifierNode) -> None:
        self._node = node
        self._goals: dict[bytes, Goal] = {}
        self._server = ActionServer(
            node,
            IdentifyInertia,
            f"~/{NAME}",
            self._ended,
            handle_accepted_callback=self._begin,
            cancel_callback=self._cancel,
        )

    def _begin(self, handle: ServerGoalHandle) -> None:
        """Begin the fit. Every goal is accepted: a refusal has no place for the reason."""
        goal = self._goals[bytes(handle.goal_id.uuid)] = Goal(handle)
        handle.execute()  # from now on it may be cancelled; _ended waits for its end
        try:
            self._node.fits.refuse_when_busy()
            self._node.fits.begin(NAME, self._job(handle.request), goal)
        except RigIdentificationError as error:
            goal.fail(str(error))
        except Exception as error:  # the client would wait for ever
            goal.fail(f"defect: {type(error).__name__}: {error}")
            raise

    def _job(self, request: IdentifyInertia.Goal) -> Job:
        if not request.work >= 0.0:
            raise InputError(f"work {request.work}: give units of work above 0, or 0 for the default")
        session, basis = self._node.chosen(request.session, list(request.windows))
        out = Path(request.out).expanduser() if request.out else self._new_folder()
        return Job(session, basis, request.work or None, out, elsewhere=not request.out)

    def _new_folder(self) -> Path:
        """A folder beside the windows that is not there yet."""
        root = self._node.windows.folder
        return next(folder for n in count(1) if not (folder := root / f"result_{n}").exists())

    def _cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        request = self._node.fits.request
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is None or request is None or request.asker is not goal:
            return CancelResponse.REJECT  # it ends by itself in a moment
        self._node.fits.interrupt()
        return CancelResponse.ACCEPT

    async def _ended(self, handle: ServerGoalHandle) -> IdentifyInertia.Result:
        goal = self._goals[bytes(handle.goal_id.uuid)]
        state, result = await goal.ended
        del self._goals[bytes(handle.goal_id.uuid)]
        getattr(handle, state)()
        return result

    def close(self) -> None:
        """Withdraw the action."""
        self._server.destroy()


def result_message(latest: dict[str, Any]) -> IdentifyInertia.Result:
    """An answer as the action's result."""
    result, files = latest["result"], latest["files"]
    stamp = Time(nanoseconds=round(latest["stamp"] * 1e9)).to_msg()
    return IdentifyInertia.Result(
        interrupted=latest["interrupted"],
        verdict=result["mismatch"]["verdict"],
        explanation=latest["explanation"],
        body=body_message(result, stamp, latest["session_sha256"]),
        findings=[finding_message(finding) for finding in result["mismatch"]["findings"]],
        recordings=latest["recordings"],
        notes=latest["notes"],
        result_file=files.get("result.json", ""),
        report_file=files.get("report.html", ""),
    )
