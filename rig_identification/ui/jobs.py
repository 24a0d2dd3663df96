"""Long tasks in processes of their own: the page stays quick, and each can be stopped."""

from __future__ import annotations

import json
import os
import secrets
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from rig_identification.errors import InputError

PROGRAM = (sys.executable, "-m", "rig_identification.ui.worker")
#: Tasks at once: a fit takes all cores by itself.
MOST_RUNNING = 2
#: Tasks of which the page still tells how they ended.
MOST_KEPT = 50
#: s that a task has to write its best answer after it was told to stop.
PATIENCE = 30.0
RUNNING, DONE, FAILED, STOPPED = "running", "done", "failed", "stopped"


@dataclass
class Job:
    """One task: how far it is, and how it ended."""

    id: str
    task: str
    title: str
    process: subprocess.Popen[str]
    started: float  # s, monotonic
    out: str = ""  # name of the folder that its files go to
    ended: float | None = None
    state: str = RUNNING
    stage: str = "starting"
    fraction: float | None = None
    stages: list[str] = field(default_factory=list)
    message: str = ""
    answer: dict[str, Any] = field(default_factory=dict)
    stopping: bool = False

    @property
    def seconds(self) -> float:
        """Since it began, or until it ended."""
        return (time.monotonic() if self.ended is None else self.ended) - self.started

    def told(self) -> dict[str, Any]:
        """What the page shows while it runs."""
        return {
            "state": self.state,
            "stage": self.stage,
            "fraction": self.fraction,
            "seconds": round(self.seconds, 1),
            "stages": self.stages[-12:],
            "stopping": self.stopping,
        }


class Jobs:
    """All tasks of one page."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._lock = threading.Lock()

    def start(self, task: str, title: str, request: Mapping[str, Any], out: str = "") -> Job:
        """Begin a task. out: where its files go, for the page. Raises InputError where as many run as may."""
        with self._lock:
            running = [job for job in self._jobs.values() if job.state == RUNNING]
            if len(running) >= MOST_RUNNING:
                raise InputError(f"{len(running)} tasks are running; stop one or wait for it")
            for old in list(self._jobs)[: max(0, len(self._jobs) - MOST_KEPT + 1)]:
                if self._jobs[old].state != RUNNING:
                    del self._jobs[old]
            job = Job(secrets.token_urlsafe(9), task, title, _process(), time.monotonic(), out)
            self._jobs[job.id] = job
        threading.Thread(target=self._follow, args=(job, {"task": task, **request}), daemon=True).start()
        return job

    def get(self, name: str) -> Job | None:
        """The task of this id."""
        return self._jobs.get(name)

    def all(self) -> list[Job]:
        """Every task, the latest first."""
        return list(self._jobs.values())[::-1]

    def stop(self, job: Job) -> None:
        """Ask a task to end with the best answer that it has; asked again, end it at once."""
        if job.state != RUNNING:
            return
        if job.stopping:
            job.process.kill()
            return
        job.stopping = True
        job.process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)
        timer = threading.Timer(PATIENCE, job.process.kill)
        timer.daemon = True
        timer.start()

    def end(self) -> None:
        """End all tasks at once."""
        for job in self.all():
            if job.state == RUNNING:
                job.process.kill()

    def _follow(self, job: Job, request: Mapping[str, Any]) -> None:
        """Hand over the request and take what the process tells until it ends."""
        process = job.process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            # Left open: its end tells the process that the page is gone
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            for line in process.stdout:
                self._take(job, json.loads(line))
        except (OSError, ValueError):
            process.kill()
        code = process.wait()
        for stream in (process.stdin, process.stdout):
            stream.close()
        with self._lock:
            job.ended = time.monotonic()
            if job.state == RUNNING:
                job.state = STOPPED if job.stopping else FAILED
                job.message = job.message or ("stopped" if job.stopping else f"the process ended with {code}")

    def _take(self, job: Job, told: Mapping[str, Any]) -> None:
        with self._lock:
            if "stage" in told:
                if told["stage"] != job.stage:
                    job.stages.append(job.stage)
                job.stage, job.fraction = told["stage"], told["fraction"]
            else:
                job.message, job.answer = told.get("message", ""), told.get("answer", {})
                job.state = told["state"]


def _process() -> subprocess.Popen[str]:
    # A session of its own: an interrupt from the terminal is for the page, which ends its tasks
    return subprocess.Popen(
        PROGRAM, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        text=True, encoding="utf-8", start_new_session=True,
        env={**os.environ, "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "1")},
    )  # fmt: skip
