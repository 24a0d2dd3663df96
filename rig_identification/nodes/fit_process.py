"""A fit under way in another process, looked at from time to time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any


class FitProcess:
    """Starts :mod:`fit_program` on a session; :meth:`look` never waits."""

    def __init__(self, session: Path) -> None:
        self.stage, self.fraction = "starting", 0.0
        self.answer: dict[str, Any] | None = None  # the result or error, once there
        self._rest = b""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "rig_identification.nodes.fit_program", str(session)],
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
            self.answer = {"kind": "error", "message": f"the fit's process ended with status {status}"}
        return over

    def _hear(self, said: dict[str, Any]) -> None:
        if said["kind"] == "progress":
            self.stage, self.fraction = said["stage"], float(said["fraction"])
        else:
            self.answer = said

    def end(self) -> None:
        """End the process, whatever it does."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                stream.close()
