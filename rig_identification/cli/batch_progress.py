"""How far a batch is: a bar with the time left on a terminal, a line a session elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, TextIO

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

if TYPE_CHECKING:
    from rig_identification.batch.batch import Step


class BatchProgress:
    """Callable that hears of each session as it is settled.

    Parameters
    ----------
    stream : text stream
    total : int
        Sessions of the batch.
    clock : callable
        Seconds, monotonic.
    """

    def __init__(self, stream: TextIO, total: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream, self._total, self._clock = stream, total, clock
        self._start = clock()
        self._settled = self._identified = self._failed = 0
        self._bar = Progress(
            BarColumn(bar_width=30),
            MofNCompleteColumn(),
            TextColumn("{task.description}"),
            console=Console(file=stream),
            transient=True,
            disable=not stream.isatty(),
        )
        self._task = self._bar.add_task("", total=total)

    def __call__(self, step: Step) -> None:
        """Count a session, and say what became of it and how long the others will take."""
        self._settled += 1
        self._identified += not step.again
        self._failed += step.record.status != "done"
        told = f"{self._failed} failed, {self.left()}"
        if self._bar.disable:
            what = f"{step.record.status} already" if step.again else step.record.status
            line = f"{self._settled} of {self._total}, {told}: {step.session.name}: {what}"
            print(line, file=self._stream, flush=True)
        else:
            self._bar.update(self._task, completed=self._settled, description=told)

    def left(self) -> str:
        """Time left, if what is left takes as long as what was identified so far did."""
        left = self._total - self._settled
        if not left:
            return "all settled"
        if not self._identified:
            return "time left not known yet"
        # What runs at once has ended at a steady rate: sessions a second, whatever --jobs is
        seconds = left * (self._clock() - self._start) / self._identified
        return f"about {duration(seconds)} left"

    def __enter__(self) -> BatchProgress:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()


def duration(seconds: float) -> str:
    """A time in the largest two units that say something."""
    minutes = max(1, round(seconds / 60.0))
    if minutes < 60:
        return f"{minutes} min"
    hours, rest = divmod(minutes, 60)
    return f"{hours} h {rest} min" if hours < 48 else f"{hours // 24} d {hours % 24} h"
