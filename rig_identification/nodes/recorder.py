"""``recorder``: contract sessions from the live graph."""

from __future__ import annotations

from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus

from rig_identification.errors import InputError
from rig_identification.nodes.bag_keeper import BagKeeper
from rig_identification.nodes.deferred import Later
from rig_identification.nodes.intake import Intake
from rig_identification.nodes.parameters import OwnParameter, one_of, within
from rig_identification.nodes.recording_parameters import RECORDING, planned
from rig_identification.nodes.rig_node import ERROR, OK, RigNode, diagnostic
from rig_identification.nodes.session_folder import SessionFolder
from rig_identification.nodes.stream_diagnostics import stream_status
from rig_identification.topics import expected_topics

PARAMETERS = (
    OwnParameter("folder", "session", "the session's folder; it must be new"),
    OwnParameter("storage", "mcap", "mcap or sqlite3", one_of("mcap", "sqlite3")),
    OwnParameter("record_at_start", False, "start the first recording with the node"),
    OwnParameter("period", 0.05, "s between writes", within(0.005, 1.0, "s")),
    OwnParameter("depth", 2000, "messages kept of each topic: seconds of the fastest", within(10, 100_000)),
    *RECORDING,
)


class RecorderNode(RigNode):
    """Writes what is sent while it records, as it arrived."""

    def __init__(self) -> None:
        super().__init__("recorder", PARAMETERS)
        rig = self.rig()
        folder = Path(self.own.text("folder")).expanduser()
        if (folder / "session.yaml").exists():
            raise InputError(f"parameter folder: {folder} holds a session already; name a new one")
        topics = expected_topics(tuple(cable.name for cable in rig.cables), self.get_namespace())
        self.session = SessionFolder(folder, rig, topics, self.own.text("storage"))
        self.intake = Intake(self, topics, self.own.whole("depth"), watch_range=True)
        self.keeper = BagKeeper(self, self.session, self.intake)
        self.serve("~/start", self._start)
        self.serve("~/stop", self._stop)
        self.every(self.own.number("period"), self._work)
        if self.own.flag("record_at_start"):
            self._start()

    def _start(self) -> str:
        plan = planned(self.own, {done.name for done in self.session.done})
        self.keeper.start(plan)
        return f"recording {plan.name} ({plan.kind}) in {self.session.folder}"

    def _stop(self) -> Later:
        self._work()
        plan = self.session.plan
        if plan is None:
            raise InputError(self.keeper.trouble or "nothing is being recorded; call ~/start first")
        if self.keeper.ending:
            raise InputError(f"recording {plan.name} waits for its last messages already")

        def told(counts: dict[str, int]) -> str:
            messages = f"{sum(counts.values())} messages on {len(counts)} topics"
            return f"{plan.name}: {messages} in {self.session.folder}"

        nothing = f"recording {plan.name}: no message came on any topic; nothing was written"
        return self.keeper.stop(told, nothing)

    def _work(self) -> None:
        for batch in self.intake.take():
            self.keeper.write(batch)
        self.keeper.look()

    def status(self) -> list[DiagnosticStatus]:
        """What is being recorded, and every topic."""
        plan = self.session.plan
        message = f"recording {plan.name}" if plan else "not recording"
        line = diagnostic(
            f"{self.get_name()}: recording", ERROR if self.keeper.trouble else OK,
            self.keeper.trouble or message,
            messages=sum(self.session.counts.values()), done=[done.name for done in self.session.done],
        )  # fmt: skip
        return [*super().status(), line, *stream_status(self, self.intake)]

    def close(self) -> None:
        """Finish the open bag."""
        self._work()
        self.keeper.close()


def create() -> RecorderNode:
    """The node."""
    return RecorderNode()
