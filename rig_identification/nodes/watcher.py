"""The live verdict beside the identifier: windows so far go to a program, what it says is published."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from std_msgs.msg import String

from rig_identification.errors import InputError
from rig_identification.nodes.gathered import Gathered, write_gathered
from rig_identification.nodes.intake import Batch
from rig_identification.nodes.rig_node import LATCHED, RigNode
from rig_identification.nodes.session_folder import RecordingPlan, SessionFolder
from rig_identification.rig import Rig
from rig_identification.session.exciter_commands import read_commands
from rig_identification.session.rig_document import rig_document
from rig_identification.watching import LONGEST, SHORTEST

#: Windows at rest that are kept beside the run: the latest.
MOST_AT_REST = 4
#: Times that a program which ended by itself is started again.
MOST_STARTS = 3


class Watcher:
    """Gathers what the open window holds, and has it looked at every ``period`` s.

    Parameters
    ----------
    node : RigNode
    rig : Rig
    period : float
        s between the end of a look and the next one, at least as long as that took; 0: nothing is watched.
    seconds, aim : float
        Planned length of a run, s, and the share of J's size to which it is to be known (watching.py).
    planned_force : str
        File of the exciter's commands, for the forecast; empty: none.

    Raises
    ------
    InputError
        That file cannot be used.
    """

    def __init__(
        self, node: RigNode, rig: Rig, period: float, seconds: float, aim: float, planned_force: str = ""
    ) -> None:
        self._node, self._rig, self._period = node, rig, period
        self._arguments = (f"{seconds}", f"{aim}", node.get_namespace())
        self._commands = _commands(rig, planned_force) if planned_force else b""
        self._publisher = node.create_publisher(String, "~/watch", LATCHED)
        self._at_rest: list[Gathered] = []
        self._open: Gathered | None = None
        self._folder: Path | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._rest, self._busy, self._next, self._starts = b"", False, 0.0, 0
        self.said = "nothing was watched yet"

    def start(self, plan: RecordingPlan) -> None:
        """A window is open."""
        if self._period > 0.0 and not plan.holdout:
            self._open, self._next = Gathered(plan, LONGEST), 0.0

    def stop(self) -> None:
        """The window is closed."""
        window, self._open = self._open, None
        if window is not None and window.plan.kind == "static":
            self._at_rest = [*self._at_rest, window][-MOST_AT_REST:]

    def forget(self) -> None:
        """All windows are gone."""
        self._open, self._at_rest = None, []

    def add(self, batch: Batch) -> None:
        """Samples of the open window."""
        if self._open is not None:
            self._open.add(batch)

    def look(self) -> None:
        """Publish what the program said, and ask it again when it is time. Never waits."""
        if self._process is not None:
            self._hear(self._process)
        window, now = self._open, time.monotonic()
        if window is None or window.plan.kind != "dynamic" or self._busy or now < self._next:
            return
        if window.seconds < SHORTEST or self._starts > MOST_STARTS:
            return
        process = self._process or self._begin()
        assert self._folder is not None
        assert process.stdin is not None
        file = self._folder / "gathered.npz"
        try:
            write_gathered(file, [*self._at_rest, window])
            line = json.dumps({"file": str(file), "whole": window.whole})
            process.stdin.write(line.encode() + b"\n")
            process.stdin.flush()
        except OSError as error:
            self.said, self._next = f"not watched: {error}", now + self._period
            return
        self._busy = True

    def _begin(self) -> subprocess.Popen[bytes]:
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="rig_watch_"))
            SessionFolder(self._folder, self._rig, {}).write_yaml("rig.yaml", rig_document(self._rig))
        arguments = [str(self._folder / "rig.yaml"), *self._arguments]
        if self._commands:
            (self._folder / "exciter.csv").write_bytes(self._commands)
            arguments.append(str(self._folder / "exciter.csv"))
        self._starts += 1
        self._process = subprocess.Popen(
            [sys.executable, "-m", "rig_identification.nodes.watch_program", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            start_new_session=True,  # a terminal's Ctrl-C is the node's business
        )
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)
        return self._process

    def _hear(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        over = process.poll() is not None
        while chunk := process.stdout.read(65536):
            self._rest += chunk
        *lines, self._rest = self._rest.split(b"\n")
        for line in lines:
            self._tell(json.loads(line))
        if over:
            self.said = f"the program that watches ended with status {process.returncode}"
            self._end()

    def _tell(self, answer: dict[str, Any]) -> None:
        self._busy = False
        self._next = time.monotonic() + max(self._period, float(answer["took"]))
        self.said = str(answer["text"])
        self._publisher.publish(String(data=json.dumps(answer, allow_nan=False)))

    def _end(self) -> None:
        process, self._process = self._process, None
        self._busy, self._rest = False, b""
        if process is None:
            return
        if process.poll() is None:
            process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except OSError:
                    continue

    def close(self) -> None:
        """End the program and leave no file. Whoever calls :meth:`look` after it starts no other one."""
        self.forget()
        self._end()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None


def _commands(rig: Rig, file: str) -> bytes:
    """The exciter's commands as they stand in the file now. Raises InputError where they cannot be used."""
    if rig.exciter is None:
        raise InputError("parameter planned_force: the rig description has no exciter; leave it out")
    path = Path(file).expanduser()
    try:
        read_commands(path)
        return path.read_bytes()
    except InputError as error:
        raise InputError(f"parameter planned_force: {error}") from error
    except OSError as error:
        raise InputError(f"parameter planned_force: {path}: {error.strerror}; name another file") from error
