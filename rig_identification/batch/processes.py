"""Sessions identified side by side, each in a process of its own.

A crash, or a session that takes all of the memory, ends one process and no other. Each answer is that of
``rig-identification identify``, however many run at once.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from rig_identification.batch.record import DEFECT, DONE, STOPPED, UNUSABLE

#: Cores that a fit spreads its runs over (estimate/side_by_side.py).
CORES = "RIG_IDENTIFICATION_CORES"
PROGRAM = (sys.executable, "-m", "rig_identification.cli.main")
#: Exit status of ``identify`` -> what became of the session; a signal's is below 0.
_OF_STATUS = {0: DONE, 1: DEFECT, 2: UNUSABLE}

Task = TypeVar("Task")
Outcome = TypeVar("Outcome")


@dataclass(frozen=True)
class Ended:
    """How the identification of one session ended."""

    status: str
    message: str = ""


class Processes:
    """Processes that identify, all of which can be stopped."""

    def __init__(self, cores: int) -> None:
        self._environment = {**os.environ, CORES: str(cores)}
        self._running: set[subprocess.Popen[str]] = set()
        self._lock = threading.Lock()
        self._stopped = False

    def identify(self, session: Path, out: Path, options: Sequence[str]) -> Ended:
        """Identify one session into ``out`` and wait for it."""
        return self.call((*PROGRAM, "identify", str(session), "--out", str(out), *options))

    def call(self, command: Sequence[str]) -> Ended:
        """Run a command that answers like ``rig-identification`` and wait for it."""
        with self._lock:
            if self._stopped:
                return Ended(STOPPED, "stopped before it began")
            # A session of its own: an interrupt from the terminal is for the batch, which stops its processes
            process = subprocess.Popen(
                command, env=self._environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE, text=True, errors="replace", start_new_session=True,
            )  # fmt: skip
            self._running.add(process)
        _, said = process.communicate()
        with self._lock:
            self._running.discard(process)
        return _ended(process.returncode, said, self._stopped)

    def stop(self) -> None:
        """End all processes; none begins any more."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                process.terminate()


def _ended(code: int, said: str, stopped: bool) -> Ended:
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    message = lines[-1].removeprefix("rig-identification: ").removeprefix("error: ") if lines else ""
    if code in _OF_STATUS:
        return Ended(_OF_STATUS[code], "" if code == 0 else message)
    why = f"ended by signal {-code}" if code < 0 else f"ended with status {code}"
    return Ended(STOPPED, why if stopped or not message else f"{why}: {message}")


def side_by_side(
    task: Callable[[Task], Outcome], over: Sequence[Task], jobs: int, stop: Callable[[], None]
) -> Iterator[tuple[Task, Outcome]]:
    """Each task's outcome as it ends, ``jobs`` at once. ``stop``: called on an interrupt."""
    pool = ThreadPoolExecutor(jobs)
    waiting: dict[Future[Outcome], Task] = {}
    try:
        waiting = {pool.submit(task, item): item for item in over}
        while waiting:
            done, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                yield waiting.pop(future), future.result()
    except BaseException:
        for future in waiting:
            future.cancel()
        stop()
        raise
    finally:
        pool.shutdown(wait=True)
