"""What was sent between a start and a stop, as bags of a session: the recorder's work and the identifier's.

A recording holds what was sent while it ran, not what arrived: what the middleware held back for seconds
(live/sending_clock.py) is waited for at the end, and what is still under way from before is left out.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from rclpy.node import Node

from rig_identification.errors import InputError
from rig_identification.nodes.deferred import Later
from rig_identification.nodes.intake import Batch, Intake
from rig_identification.nodes.session_folder import DiskFull, RecordingPlan, SessionFolder

#: s that a topic's last messages are waited for: the middleware asks again for what was lost within 3 s.
PATIENCE = 5.0
#: s without a message on any topic after which nothing more is under way.
QUIET = 1.5
_FOREVER = np.iinfo(np.int64).max


@dataclass(frozen=True)
class _Asked:
    """A stop that waits for the last messages."""

    told: Callable[[dict[str, int]], str]
    nothing: str
    later: Later


class BagKeeper:
    """One open recording at a time.

    Parameters
    ----------
    node : Node
    folder : SessionFolder
    intake : Intake
        Of the topics to keep; :meth:`write` is given its batches, then :meth:`look` is called.
    """

    def __init__(self, node: Node, folder: SessionFolder, intake: Intake) -> None:
        self._node, self.folder, self.intake = node, folder, intake
        self.trouble = ""  # why the latest recording ended before it was told to
        self._begun_ns, self._ending_ns = 0, _FOREVER  # sent from then on, and until then
        self._sent: dict[str, int] = {}  # ns, the latest of each topic
        self._asked = self._heard = 0.0  # s, steady: the stop, and the latest message after it
        self._stop: _Asked | None = None

    @property
    def plan(self) -> RecordingPlan | None:
        """Of the open recording."""
        return self.folder.plan

    @property
    def ending(self) -> bool:
        """Whether the last messages of the open recording are waited for."""
        return self._stop is not None

    def start(self, plan: RecordingPlan) -> None:
        """Open a recording of what is sent from now on. Raises InputError."""
        if self.ending and self.plan is not None:
            raise InputError(
                f"recording {self.plan.name} waits for its last messages; start again in a moment"
            )
        self.intake.take()  # what came before does not belong to it
        self.folder.start(plan)
        self.trouble = ""
        self._begun_ns, self._ending_ns = time.time_ns(), _FOREVER
        self._sent = {}

    def stop(self, told: Callable[[dict[str, int]], str], nothing: str) -> Later:
        """Close the open recording once all that was sent until now is there.

        told: what the caller hears, of the messages of each topic; nothing: where none came, and
        :attr:`trouble` does not say why.
        """
        self._ending_ns, self._asked = time.time_ns(), time.monotonic()
        self._heard, self._stop = self._asked, _Asked(told, nothing, Later())
        return self._stop.later

    def write(self, batch: Batch) -> None:
        """Write what belongs to the open recording. On a full disk it ends, and :attr:`trouble` says so."""
        if self.plan is None or not len(batch):
            return
        name = batch.topic.name
        self._sent[name], self._heard = int(batch.sent_ns[-1]), time.monotonic()
        inside = np.flatnonzero((batch.sent_ns >= self._begun_ns) & (batch.sent_ns <= self._ending_ns))
        try:
            self.folder.add(
                name, [batch.messages[k] for k in inside], [int(batch.arrival_ns[k]) for k in inside]
            )
        except DiskFull as error:
            self.trouble = str(error)
            self._node.get_logger().error(self.trouble)

    def look(self) -> None:
        """Close the recording that was told to end, if nothing of it is under way any longer."""
        if self._stop is None:
            return
        now = time.monotonic()
        if now - self._asked > PATIENCE or now - self._heard > QUIET or self._complete():
            self.close()

    def _complete(self) -> bool:
        """Whether each topic that somebody sends on has brought something that was sent after the end."""
        return all(
            self._sent.get(name, 0) > self._ending_ns
            for name, gate in self.intake.gates.items()
            if gate.received and self._node.count_publishers(name)
        )

    def close(self) -> None:
        """Close the open recording as it is, and answer who waits for that."""
        asked, self._stop = self._stop, None
        counts = dict(self.folder.counts)
        try:
            came = self.folder.stop() is not None
        except InputError as error:
            if asked is None:
                raise
            asked.later.answer(False, str(error))
            return
        if asked is not None:
            asked.later.answer(came, asked.told(counts) if came else self.trouble or asked.nothing)
