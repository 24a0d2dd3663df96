"""Fits that the identifier is asked for: one at a time, in a process of its own, and the latest answer."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from rig_identification.errors import InputError
from rig_identification.files import nearest_existing
from rig_identification.nodes.worker_process import WorkerProcess

#: s that an interrupted fit gets to say its best answer until then. It heeds the interrupt between two
#: compiled calls, which take up to a second; composing and writing an answer takes a few. A busy machine
#: takes several times as long.
PATIENCE = 20.0


@dataclass(frozen=True)
class Job:
    """What is to be fitted."""

    session: Path  # session.yaml
    basis: tuple[str, ...]  # what the answer rests on: the same basis gives the same answer
    work: float | None = None  # units of work; None: the default
    out: Path | None = None  # folder for result.json and report.html; None: not written
    elsewhere: bool = False  # whether files that were written to another folder before will do


class Asker(Protocol):
    """Who waits for a fit."""

    def hear(self, stage: str, fraction: float, numbers: dict[str, Any] | None) -> None:
        """What is being done, and the body as known until now."""

    def answer(self, latest: dict[str, Any]) -> None:
        """The fit went well."""

    def fail(self, message: str) -> None:
        """There is no answer."""


@dataclass
class Request:
    """A fit under way and who waits for it."""

    run: int
    name: str
    asker: Asker
    job: Job
    process: WorkerProcess
    ended_at: float | None = None  # s, steady: when an interrupted fit is ended; None: it was not interrupted


class Fits:
    """Starts fits, watches them and keeps the latest answer.

    Parameters
    ----------
    now : callable
        Seconds of the node's clock, for an answer's stamp.
    told : callable
        Is given a request whose progress is new.
    done : callable
        Is given each answer that went well and came to its end.
    """

    def __init__(
        self,
        now: Callable[[], float],
        told: Callable[[Request], None],
        done: Callable[[dict[str, Any]], None],
    ) -> None:
        self._now, self._told, self._done = now, told, done
        self.request: Request | None = None
        self.latest: dict[str, Any] | None = None
        self._job: Job | None = None  # that the latest answers
        self._runs = 0

    def refuse_when_busy(self) -> None:
        """Raise InputError where a fit runs."""
        if self.request is not None:
            r = self.request
            done = f"{100.0 * r.process.fraction:.0f} % done ({r.process.stage})"
            raise InputError(f"busy: {r.name}, run {r.run}, is {done}; wait for it or call ~/cancel")

    def begin(self, name: str, job: Job, asker: Asker) -> None:
        """Begin a fit; ``asker`` hears of it. The same data give the same answer, at once.

        Raises
        ------
        InputError
            A fit runs already, or the folder for the files cannot be written to.
        """
        self.refuse_when_busy()
        if self.latest is not None and self._job is not None and self._answers(self._job, job):
            asker.answer(self.latest)
            return
        arguments = [str(job.session)]
        if job.work is not None:
            arguments += ["--work", str(job.work)]
        if job.out is not None:
            refuse_unwritable(job.out)
            arguments += ["--out", str(job.out)]
        self._runs += 1
        self.request = Request(self._runs, name, asker, job, WorkerProcess("fit_program", *arguments))

    def forget_job(self) -> None:
        """Fit anew whatever is asked next: the recordings of the latest answer are gone."""
        self._job = None

    @staticmethod
    def _answers(done: Job, asked: Job) -> bool:
        """Whether what was done answers what is asked."""
        same = (done.session, done.basis, done.work) == (asked.session, asked.basis, asked.work)
        there = asked.out in (None, done.out) or (asked.elsewhere and done.out is not None)
        return same and there

    def look(self) -> None:
        """Take in what the fit said, and hand on its answer."""
        request = self.request
        if request is None:
            return
        process = request.process
        before = (process.stage, process.fraction, process.numbers)
        if request.ended_at is not None and time.monotonic() > request.ended_at:
            process.kill()
        over = process.look()
        if before != (process.stage, process.fraction, process.numbers):
            request.asker.hear(process.stage, process.fraction, process.numbers)
            self._told(request)
        if over:
            self.request = None
            process.end()
            self._end(request, process.answer or {})

    def _end(self, request: Request, answer: dict[str, Any]) -> None:
        if answer["kind"] == "cancelled":
            request.asker.fail(f"{request.name}, run {request.run}, was cancelled before there was an answer")
            return
        if answer["kind"] == "error":
            request.asker.fail(str(answer["message"]))
            return
        told = {**answer, "run": request.run, "stamp": self._now()}
        if not answer["interrupted"]:
            self.latest, self._job = told, request.job
            self._done(told)
        request.asker.answer(told)

    def cancel(self) -> str:
        """End the fit that runs, at once and without an answer. Raises InputError: none runs."""
        if self.request is None:
            raise InputError("nothing runs that could be cancelled")
        request, self.request = self.request, None
        request.process.end()
        request.asker.fail(f"{request.name}, run {request.run}, was cancelled")
        return f"{request.name}, run {request.run}, is cancelled"

    def interrupt(self) -> None:
        """Ask the fit that runs for its best answer until now; it comes within :data:`PATIENCE`, or none."""
        if self.request is not None and self.request.ended_at is None:
            self.request.ended_at = time.monotonic() + PATIENCE
            self.request.process.interrupt()

    def close(self) -> None:
        """End the fit; nobody is told."""
        if self.request is not None:
            self.request.process.end()
            self.request = None


def refuse_unwritable(folder: Path) -> None:
    """Refuse a folder that files cannot be written to, before minutes are spent. Raises InputError."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"out {folder}: is a file; name a folder")
    parent = nearest_existing(folder)
    if not (parent.is_dir() and os.access(parent, os.W_OK | os.X_OK)):
        raise InputError(f"out {folder}: {parent} cannot be written to; name another folder")
