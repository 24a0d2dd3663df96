"""Tasks side by side, one a core.

What takes the time holds no lock, and no task knows of another: however many cores, one result. What a task
computes counts as work of whoever put it there (model/work.py).
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, copy_context
from typing import TypeVar

Task = TypeVar("Task")
Outcome = TypeVar("Outcome")

#: Tasks at once at most: a handful of pieces share one memory.
MOST = 8
#: Environment variable with the cores that this process may use, where several share a machine.
SHARE = "RIG_IDENTIFICATION_CORES"

_lock = threading.Lock()
_running = 0


def cores() -> int:
    """Cores that this process may use, as far as tasks are put side by side on them."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    share = os.environ.get(SHARE, "")
    return min(MOST, usable, max(1, int(share)) if share.isdecimal() else MOST)


def spare() -> int:
    """Cores for whoever asks, its own among them: those that no other task is on."""
    return max(1, cores() - max(_running - 1, 0))


def side_by_side(task: Callable[[Task], Outcome], over: Iterable[Task]) -> list[Outcome]:
    """Outcome of a task for each of several things, in their order."""

    def counted(context: Context, item: Task) -> Outcome:
        _count(1)
        try:
            return context.run(task, item)
        finally:
            _count(-1)

    items = list(over)
    with ThreadPoolExecutor(max_workers=cores()) as pool:
        # A context can be entered by one thread at a time: each task has a copy of its own
        return list(pool.map(counted, [copy_context() for _ in items], items))


def _count(change: int) -> None:
    global _running
    with _lock:
        _running += change
