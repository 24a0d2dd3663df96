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
            TextColumn("{task.fields[beside]}"),
            console=Console(file=stream),
            transient=True,
            disable=not self.terminal,
        )
        self._task = self._bar.add_task("", total=None, beside="")

    def __call__(self, stage: str, fraction: float | None = None, beside: str = "") -> None:
        """Report a stage, the fraction of it that is done, 0 to 1, and what else is to be said of it."""
        if self.terminal:
            total = None if fraction is None else 1.0
            self._bar.update(
                self._task, description=stage, total=total, completed=fraction or 0.0, beside=beside
            )
        elif stage != self._stage:
            self._line(f"{stage} ({beside})" if beside else stage)
        self._stage = stage

    def say(self, text: str) -> None:
        """Say something that stays: a line above the bar, or a line among the stages."""
        if self.terminal:
            self._bar.console.print(text, markup=False, highlight=False)
        else:
            self._line(text)

    def _line(self, text: str) -> None:
        if self._clock() - self._start > QUIET_SECONDS:
            print(text, file=self._stream, flush=True)

    def __enter__(self) -> StageProgress:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()
