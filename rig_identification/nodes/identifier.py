"""``identifier``: collects windows of the live stream or opens a session, and answers what the body is."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import InertiaStamped
from rclpy.time import Time
from std_msgs.msg import Float64MultiArray, String

from rig_identification.errors import InputError
from rig_identification.nodes.bag_keeper import BagKeeper
from rig_identification.nodes.chosen_session import chosen_session
from rig_identification.nodes.deferred import Later
from rig_identification.nodes.fits import Fits, Job, Request
from rig_identification.nodes.intake import Intake
from rig_identification.nodes.parameters import OwnParameter, one_of, within
from rig_identification.nodes.recording_parameters import RECORDING, planned
from rig_identification.nodes.result_messages import inertia_message, matrix_message, mismatch_message
from rig_identification.nodes.rig_node import ERROR, LATCHED, OK, RigNode, diagnostic
from rig_identification.nodes.running import RunningEstimator
from rig_identification.nodes.session_folder import RecordingPlan, SessionFolder
from rig_identification.nodes.stream_diagnostics import stream_status
from rig_identification.nodes.typed import typed_interface
from rig_identification.nodes.watcher import Watcher
from rig_identification.topics import expected_topics

PARAMETERS = (
    OwnParameter(
        "session", "", "recorded session to identify; empty: the windows of this node", settable=True
    ),
    OwnParameter("windows", [""], "names of the windows or recordings to use; empty: all", settable=True),
    OwnParameter("spool", "", "folder for windows, kept as a session; empty: a temporary one"),
    OwnParameter("storage", "mcap", "mcap or sqlite3, of windows", one_of("mcap", "sqlite3")),
    OwnParameter("period", 0.05, "s between looks at what arrived", within(0.005, 1.0, "s")),
    OwnParameter("depth", 2000, "messages kept of each topic: seconds of the fastest", within(10, 100_000)),
    OwnParameter("running_rate", 0.5, "Hz of the running estimate; 0: none", within(0.0, 10.0, "Hz")),
    OwnParameter(
        "watch_period",
        5.0,
        "s between looks at the open window, and as long as one takes; 0: none",
        within(0.0, 600.0, "s"),
    ),
    OwnParameter(
        "planned_seconds", 60.0, "s that a run is to last, for the forecast", within(5.0, 3600.0, "s")
    ),
    OwnParameter(
        "aim", 0.01, "95 % half-width of J as a share of its size that is enough", within(1e-6, 1.0)
    ),
    OwnParameter(
        "planned_force",
        "",
        "exciter.csv of rig-identification plan, for the forecast; empty: the force goes on as it was last",
    ),
    *RECORDING,
)
#: Parts of a result that each request is answered with.
PARTS = {
    "identify_center_of_mass": ("mass", "center_of_mass", "unobservable"),
    "identify_inertia": ("mass", "center_of_mass", "inertia", "covariance", "without_frame", "unobservable"),
    "explain_mismatch": ("mismatch",),
    "get_center_of_mass": ("mass", "center_of_mass", "unobservable"),
    "get_inertia": ("mass", "center_of_mass", "inertia", "covariance", "without_frame", "unobservable"),
}


class ByTrigger:
    """A Trigger request that waits for a fit."""

    def __init__(self, told: Callable[[dict[str, Any]], str]) -> None:
        self.later = Later()
        self._told = told

    def hear(self, stage: str, fraction: float, numbers: dict[str, Any] | None) -> None:
        """Progress has a topic of its own."""

    def answer(self, latest: dict[str, Any]) -> None:
        """The fit went well."""
        self.later.answer(True, self._told(latest))

    def fail(self, message: str) -> None:
        """There is no answer."""
        self.later.answer(False, message)


class IdentifierNode(RigNode):
    """Windows in, results out; fits run in a process of their own."""

    def __init__(self) -> None:
        super().__init__("identifier", PARAMETERS)
        self._description = self.rig()
        self.watcher = Watcher(
            self, self._description, self.own.number("watch_period"), self.own.number("planned_seconds"),
            self.own.number("aim"), self.own.text("planned_force"),
        )  # fmt: skip
        spool = self.own.text("spool")
        self._temporary = not spool
        folder = Path(spool).expanduser() if spool else Path(tempfile.mkdtemp(prefix="rig_identifier_"))
        if (folder / "session.yaml").exists():
            raise InputError(f"parameter spool: {folder} holds a session already; name a new folder")
        names = tuple(cable.name for cable in self._description.cables)
        topics = expected_topics(names, self.get_namespace())
        self.windows = SessionFolder(folder, self._description, topics, self.own.text("storage"))
        self.intake = Intake(self, topics, self.own.whole("depth"), watch_range=True)
        self.running = RunningEstimator(self, self._description, self.own.number("running_rate"))
        self.fits = Fits(lambda: self.get_clock().now().nanoseconds / 1e9, self._tell, self._publish)
        self.keeper = BagKeeper(self, self.windows, self.intake)
        self._offer()
        self.typed = typed_interface(self)
        self.every(self.own.number("period"), self._work)

    def _offer(self) -> None:
        for name in ("identify_center_of_mass", "identify_inertia", "explain_mismatch"):
            self.serve(f"~/{name}", lambda name=name: self._begin(name))  # type: ignore[misc]
        for name in ("get_center_of_mass", "get_inertia"):
            self.serve(f"~/{name}", lambda name=name: self._latest(name))  # type: ignore[misc]
        self.serve("~/start_window", self._start_window)
        self.serve("~/stop_window", self._stop_window)
        self.serve("~/clear_windows", self._clear_windows)
        self.serve("~/cancel", self._cancel)
        self._inertia = self.create_publisher(InertiaStamped, "~/inertia", LATCHED)
        self._covariance = self.create_publisher(Float64MultiArray, "~/covariance", LATCHED)
        self._mismatch = self.create_publisher(DiagnosticArray, "~/mismatch", LATCHED)
        self._result = self.create_publisher(String, "~/result", LATCHED)
        self._progress = self.create_publisher(String, "~/progress", 10)

    # Windows

    def _start_window(self) -> str:
        return self.open_window(planned(self.own, self.taken_names()))

    def taken_names(self) -> set[str]:
        """Names of the windows that are complete."""
        return {done.name for done in self.windows.done}

    def open_window(self, plan: RecordingPlan) -> str:
        """Open a window; returns what to tell. Raises InputError."""
        self.keeper.start(plan)
        self.running.listen(plan.kind == "dynamic")
        self.watcher.start(plan)
        return f"window {plan.name} ({plan.kind}) is open"

    def _stop_window(self) -> Later:
        return self.close_window(lambda plan, counts, silent: None)

    def close_window(self, closed: Callable[[RecordingPlan, dict[str, int], list[str]], None]) -> Later:
        """End the open window; the answer comes when all that was sent before is there. Raises InputError.

        closed: is given the window, its messages by topic, and the topics that were silent.
        """
        self._work()
        plan = self.windows.plan
        if plan is None:
            raise InputError(self.keeper.trouble or "no window is open; call ~/start_window first")
        if self.keeper.ending:
            raise InputError(f"window {plan.name} waits for its last messages already")
        self.running.listen(False)
        self.watcher.stop()

        def told(counts: dict[str, int]) -> str:
            missing = [name for name in self._expected() if not counts.get(name)]
            closed(plan, counts, missing)
            silent = f"; silent: {', '.join(missing)}" if missing else ""
            return f"window {plan.name}: {sum(counts.values())} messages on {len(counts)} topics{silent}"

        nothing = f"window {plan.name}: no message came on any topic; nothing was kept"
        return self.keeper.stop(told, nothing)

    def _expected(self) -> list[str]:
        """Topics that a window should hold: every cable's, and what came at any time."""
        gates, topics = self.intake.gates, self.intake.topics
        return [name for name, gate in gates.items() if gate.received or topics[name].channel == "tension"]

    def _clear_windows(self) -> str:
        if self.windows.plan is not None or self.fits.request is not None:
            raise InputError("a window is open or a fit runs; end it first")
        for plan in self.windows.done:
            shutil.rmtree(self.windows.folder / plan.name, ignore_errors=True)
        count, self.windows.done[:] = len(self.windows.done), []
        (self.windows.folder / "session.yaml").unlink(missing_ok=True)
        self.running.forget()
        self.watcher.forget()
        self.fits.forget_job()
        return f"{count} windows are gone"

    # Requests

    def _begin(self, name: str) -> Later:
        """What the answer comes by, with the fit that begins or at once."""
        self.fits.refuse_when_busy()
        asker = ByTrigger(lambda latest: self._answer(name, latest))
        self.fits.begin(name, Job(*self.chosen(self.own.text("session"), self.own.words("windows"))), asker)
        return asker.later

    def chosen(self, session: str, names: Sequence[str]) -> tuple[Path, tuple[str, ...]]:
        """Session file to use and what an answer rests on. Raises InputError."""
        return chosen_session(self.windows, session, names)

    def latest(self) -> dict[str, Any]:
        """Answer of the latest fit that went well. Raises InputError: there is none."""
        if self.fits.latest is None:
            raise InputError("nothing was identified yet; call ~/identify_inertia")
        return self.fits.latest

    def _latest(self, name: str) -> str:
        return self._answer(name, self.latest())

    def _answer(self, name: str, latest: dict[str, Any]) -> str:
        result = latest["result"]
        parts = {part: result[part] for part in PARTS[name]}
        about = {key: latest[key] for key in ("run", "stamp", "recordings", "converged", "notes")}
        verdict = {"verdict": result["mismatch"]["verdict"], "explanation": latest["explanation"]}
        return json.dumps({**about, **verdict, **parts}, allow_nan=False)

    def _cancel(self) -> str:
        return self.fits.cancel()

    # Work

    def _work(self) -> None:
        for batch in self.intake.take():
            self.running.add(batch)
            self.watcher.add(batch)
            self.keeper.write(batch)
        self.keeper.look()
        self.watcher.look()
        self.fits.look()
        self.typed.look()

    def _tell(self, request: Request) -> None:
        told = {"run": request.run, "request": request.name}
        told |= {"stage": request.process.stage, "fraction": request.process.fraction}
        self._progress.publish(String(data=json.dumps(told)))

    def _publish(self, latest: dict[str, Any]) -> None:
        stamp = Time(nanoseconds=round(latest["stamp"] * 1e9)).to_msg()
        self._inertia.publish(inertia_message(latest["result"], stamp))
        self._covariance.publish(matrix_message(latest["result"]["covariance"]))
        self._mismatch.publish(mismatch_message(latest, stamp))
        self._result.publish(String(data=json.dumps(latest, allow_nan=False)))
        self.typed.publish(latest)

    def status(self) -> list[DiagnosticStatus]:
        """Windows, the fit under way, and every topic."""
        plan, request = self.windows.plan, self.fits.request
        message = f"window {plan.name} is open" if plan else f"{len(self.windows.done)} windows"
        if request is not None:
            message += f"; {request.name}, run {request.run}: {request.process.stage}"
        line = diagnostic(
            f"{self.get_name()}: windows", ERROR if self.keeper.trouble else OK,
            self.keeper.trouble or message,
            messages=sum(self.windows.counts.values()), done=[done.name for done in self.windows.done],
        )  # fmt: skip
        interface = diagnostic(f"{self.get_name()}: interface", OK, self.typed.told)
        watched = diagnostic(f"{self.get_name()}: watch", OK, self.watcher.said)
        return [*super().status(), line, watched, interface, *stream_status(self, self.intake)]

    def close(self) -> None:
        """End the fit, finish the window, and leave no temporary folder."""
        self.fits.close()
        self.watcher.close()
        self.typed.close()
        if not self._temporary:
            self._work()
        self.keeper.close()
        if self._temporary:
            shutil.rmtree(self.windows.folder, ignore_errors=True)


def create() -> IdentifierNode:
    """The node."""
    return IdentifierNode()
