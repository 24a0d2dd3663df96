"""Progress on standard error: a moving bar on a terminal, a line a stage elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import TextIO

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

#: Where nobody watches, work shorter than this is not worth a line.
QUIET_SECONDS = 5.0


class StageProgress:
    """Callable that names the stage under way and, where known, how far it is.

    Parameters
    ----------
    stream : text stream
    clock : callable
        Seconds, monotonic.
    """

    def __init__(self, stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self.terminal = stream.isatty()
        self._stream = stream
        self._clock = clock
        self._start = clock()
        self._stage = ""
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=30),
            TimeElapsedColumn(),
            console=Console(file=stream),
            transient=True,
            disable=not self.terminal,
        )
        self._task = self._bar.add_task("", total=None)

    def __call__(self, stage: str, fraction: float | None = None) -> None:
        """Report a stage and the fraction of it that is done, 0 to 1."""
        if self.terminal:
            total = None if fraction is None else 1.0
            self._bar.update(self._task, description=stage, total=total, completed=fraction or 0.0)
        elif stage != self._stage and self._clock() - self._start > QUIET_SECONDS:
            print(stage, file=self._stream, flush=True)
        self._stage = stage

    def __enter__(self) -> StageProgress:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()
