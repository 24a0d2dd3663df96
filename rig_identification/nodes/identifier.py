"""``identifier``: collects windows of the live stream or opens a session, and answers what the body is."""

from __future__ import annotations

import json
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import InertiaStamped
from std_msgs.msg import Float64MultiArray, String

from rig_identification.errors import InputError
from rig_identification.nodes.bag_keeper import BagKeeper
from rig_identification.nodes.deferred import Later
from rig_identification.nodes.fit_process import FitProcess
from rig_identification.nodes.intake import Intake
from rig_identification.nodes.parameters import OwnParameter, one_of, within
from rig_identification.nodes.recording_parameters import RECORDING, planned
from rig_identification.nodes.result_messages import inertia_message, matrix_message, mismatch_message
from rig_identification.nodes.rig_node import ERROR, LATCHED, OK, RigNode, diagnostic
from rig_identification.nodes.running import RunningEstimator
from rig_identification.nodes.session_folder import SessionFolder
from rig_identification.nodes.stream_diagnostics import stream_status
from rig_identification.session.session_description import read_session_description
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


@dataclass
class Request:
    """A fit under way and who waits for it."""

    run: int
    name: str
    later: Later
    process: FitProcess
    basis: tuple[str, ...]  # what the fit rests on


class IdentifierNode(RigNode):
    """Windows in, results out; fits run in a process of their own."""

    def __init__(self) -> None:
        super().__init__("identifier", PARAMETERS)
        self._description = self.rig()
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
        self.request: Request | None = None
        self.latest: dict[str, Any] | None = None  # answer of the latest fit that went well
        self._basis: tuple[str, ...] = ()
        self._runs = 0
        self.keeper = BagKeeper(self, self.windows, self.intake)
        self._offer()
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
        plan = planned(self.own, {done.name for done in self.windows.done})
        self.keeper.start(plan)
        self.running.listen(plan.kind == "dynamic")
        return f"window {plan.name} ({plan.kind}) is open"

    def _stop_window(self) -> Later:
        self._work()
        plan = self.windows.plan
        if plan is None:
            raise InputError(self.keeper.trouble or "no window is open; call ~/start_window first")
        if self.keeper.ending:
            raise InputError(f"window {plan.name} waits for its last messages already")
        self.running.listen(False)

        def told(counts: dict[str, int]) -> str:
            missing = [name for name in self._expected() if not counts.get(name)]
            silent = f"; silent: {', '.join(missing)}" if missing else ""
            return f"window {plan.name}: {sum(counts.values())} messages on {len(counts)} topics{silent}"

        nothing = f"window {plan.name}: no message came on any topic; nothing was kept"
        return self.keeper.stop(told, nothing)

    def _expected(self) -> list[str]:
        """Topics that a window should hold: every cable's, and what came at any time."""
        gates, topics = self.intake.gates, self.intake.topics
        return [name for name, gate in gates.items() if gate.received or topics[name].channel == "tension"]

    def _clear_windows(self) -> str:
        if self.windows.plan is not None or self.request is not None:
            raise InputError("a window is open or a fit runs; end it first")
        for plan in self.windows.done:
            shutil.rmtree(self.windows.folder / plan.name, ignore_errors=True)
        count, self.windows.done[:] = len(self.windows.done), []
        (self.windows.folder / "session.yaml").unlink(missing_ok=True)
        self.running.forget()
        return f"{count} windows are gone"

    # Requests

    def _begin(self, name: str) -> str | Later:
        """The answer, or that it comes with the fit that begins."""
        if self.request is not None:
            r = self.request
            done = f"{100.0 * r.process.fraction:.0f} % done ({r.process.stage})"
            raise InputError(f"busy: {r.name}, run {r.run}, is {done}; wait for it or call ~/cancel")
        session, basis = self._chosen()
        if self.latest is not None and basis == self._basis:
            return self._answer(name)  # the same data give the same result
        self._runs += 1
        later = Later()
        self.request = Request(self._runs, name, later, FitProcess(session), basis)
        return later

    def _chosen(self) -> tuple[Path, tuple[str, ...]]:
        """Session file to fit and what it rests on. Raises InputError."""
        path, names = self.own.text("session"), self.own.words("windows")
        if path:
            description = read_session_description(Path(path).expanduser())
            file, known = description.file, [entry.name for entry in description.entries]
            stamps = tuple(
                str(entry.folder.stat().st_mtime_ns) for entry in description.entries if entry.folder.exists()
            )
        else:
            if not self.windows.done:
                open_one = self.windows.plan
                told = (
                    f"window {open_one.name} is still open; call ~/stop_window and wait for its answer"
                    if open_one
                    else "call ~/start_window"
                )
                raise InputError(f"no window is complete: {told}, or set the parameter session")
            file, known, stamps = (
                self.windows.folder / "session.yaml",
                [p.name for p in self.windows.done],
                (),
            )
        unknown = [name for name in names if name not in known]
        if unknown:
            raise InputError(f"parameter windows: {', '.join(unknown)} is none of {', '.join(known)}")
        chosen = list(names) or known
        if names and not path:
            entries = [plan.entry() for plan in self.windows.done if plan.name in names]
            file = self.windows.write_yaml("chosen.yaml", {"rig": "rig.yaml", "recordings": entries})
        elif names:
            raise InputError(
                "parameter windows: chooses among windows; a session is taken whole: set windows empty"
            )
        return file, (str(file), *chosen, *stamps)

    def _latest(self, name: str) -> str:
        if self.latest is None:
            raise InputError("nothing was identified yet; call ~/identify_inertia")
        return self._answer(name)

    def _answer(self, name: str) -> str:
        assert self.latest is not None
        result = self.latest["result"]
        parts = {part: result[part] for part in PARTS[name]}
        about = {key: self.latest[key] for key in ("run", "stamp", "recordings", "converged", "notes")}
        verdict = {"verdict": result["mismatch"]["verdict"], "explanation": self.latest["explanation"]}
        return json.dumps({**about, **verdict, **parts}, allow_nan=False)

    def _cancel(self) -> str:
        if self.request is None:
            raise InputError("nothing runs that could be cancelled")
        request, self.request = self.request, None
        request.process.end()
        request.later.answer(False, f"{request.name}, run {request.run}, was cancelled")
        return f"{request.name}, run {request.run}, is cancelled"

    # Work

    def _work(self) -> None:
        for batch in self.intake.take():
            self.running.add(batch)
            self.keeper.write(batch)
        self.keeper.look()
        if self.request is not None:
            self._watch(self.request)

    def _watch(self, request: Request) -> None:
        before = (request.process.stage, request.process.fraction)
        over = request.process.look()
        if before != (request.process.stage, request.process.fraction):
            told = {"run": request.run, "request": request.name}
            told |= {"stage": request.process.stage, "fraction": request.process.fraction}
            self._progress.publish(String(data=json.dumps(told)))
        if not over:
            return
        self.request = None
        request.process.end()
        answer = request.process.answer or {}
        if answer["kind"] == "error":
            request.later.answer(False, str(answer["message"]))
            return
        now = self.get_clock().now()
        self.latest = {**answer, "run": request.run, "stamp": now.nanoseconds / 1e9}
        self._basis = request.basis
        request.later.answer(True, self._answer(request.name))
        stamp = now.to_msg()
        self._inertia.publish(inertia_message(answer["result"], stamp))
        self._covariance.publish(matrix_message(answer["result"]["covariance"]))
        self._mismatch.publish(mismatch_message(answer, stamp))
        self._result.publish(String(data=json.dumps(self.latest, allow_nan=False)))

    def status(self) -> list[DiagnosticStatus]:
        """Windows, the fit under way, and every topic."""
        plan, request = self.windows.plan, self.request
        message = f"window {plan.name} is open" if plan else f"{len(self.windows.done)} windows"
        if request is not None:
            message += f"; {request.name}, run {request.run}: {request.process.stage}"
        line = diagnostic(
            f"{self.get_name()}: windows", ERROR if self.keeper.trouble else OK,
            self.keeper.trouble or message,
            messages=sum(self.windows.counts.values()), done=[done.name for done in self.windows.done],
        )  # fmt: skip
        return [*super().status(), line, *stream_status(self, self.intake)]

    def close(self) -> None:
        """End the fit, finish the window, and leave no temporary folder."""
        if self.request is not None:
            self.request.process.end()
        self._work_quietly()
        self.keeper.close()
        if self._temporary:
            shutil.rmtree(self.windows.folder, ignore_errors=True)

    def _work_quietly(self) -> None:
        self.request = None
        if not self._temporary:
            self._work()


def create() -> IdentifierNode:
    """The node."""
    return IdentifierNode()
