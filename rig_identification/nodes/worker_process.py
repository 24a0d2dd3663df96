"""A program of this package at work in another process, looked at from time to time."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from typing import Any


class WorkerProcess:
    """Starts a program that speaks as :mod:`worker_program` does; :meth:`look` never waits.

    Parameters
    ----------
    program : str
        Module of ``rig_identification.nodes``.
    arguments : str
        Its command line.
    """

    def __init__(self, program: str, *arguments: str) -> None:
        self.stage, self.fraction = "starting", 0.0
        self.numbers: dict[str, Any] | None = None  # the body as known until now, in result.json's terms
        self.answer: dict[str, Any] | None = None  # "kind": "result", "error" or "cancelled", once there
        self._spoke = False
        self._rest = b""
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"rig_identification.nodes.{program}", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            start_new_session=True,  # a terminal's Ctrl-C is the node's business
        )
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)

    def look(self) -> bool:
        """Take in what the process said; True once it is over."""
        assert self._process.stdout is not None
        over = self._process.poll() is not None
        while chunk := self._process.stdout.read(65536):
            self._rest += chunk
        *lines, self._rest = self._rest.split(b"\n")
        for line in lines:
            self._hear(json.loads(line))
        if over and self.answer is None:
            status = self._process.returncode
            told = f"the work's process ended with status {status}"
            self.answer = {"kind": "error", "message": told}
        return over

    def _hear(self, said: dict[str, Any]) -> None:
        self._spoke = True
        if said["kind"] == "progress":
            self.stage, self.fraction = said["stage"], float(said["fraction"])
        elif said["kind"] == "numbers":
            self.numbers = said["body"]
        else:
            self.answer = said

    def interrupt(self) -> None:
        """Ask for the best answer until now. A program that has not spoken yet has none, and is ended."""
        if self._process.poll() is not None:
            return
        if self._spoke:
            self._process.send_signal(signal.SIGINT)
        else:
            self.kill()

    def kill(self) -> None:
        """End the process without an answer, unless there is one; :meth:`look` then says that it is over."""
        if self._process.poll() is None:
            self.answer = self.answer or {"kind": "cancelled"}
            self._process.kill()

    def end(self) -> None:
        """End the process, whatever it does."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
