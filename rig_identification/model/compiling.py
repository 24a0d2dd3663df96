"""Seconds that the forward model was compiled for: once after installation, a minute or two.

What is compiled is kept beside the package (numba's cache). The time of an answer does not count it, or
the first session after an installation would be searched less than any other.
"""

from __future__ import annotations

import threading
import time

from numba.core import event


class _Clock(event.Listener):
    """Time during which at least one function is compiled; one asks for others, and threads for the same."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._depth, self._since, self._sum = 0, 0.0, 0.0

    def on_start(self, event: event.Event) -> None:
        with self._lock:
            if self._depth == 0:
                self._since = time.monotonic()
            self._depth += 1

    def on_end(self, event: event.Event) -> None:
        with self._lock:
            self._depth -= 1
            if self._depth == 0:
                self._sum += time.monotonic() - self._since

    def seconds(self) -> float:
        with self._lock:
            return self._sum + (time.monotonic() - self._since if self._depth else 0.0)


_CLOCK = _Clock()
event.register("numba:compile", _CLOCK)


def seconds() -> float:
    """Seconds, since this was imported, during which anything was compiled."""
    return _CLOCK.seconds()
