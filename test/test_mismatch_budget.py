"""The time of an answer, and what of it is compiling."""

from __future__ import annotations

import time

from numba import njit

from rig_identification.mismatch.budget import UNLIMITED, Budget
from rig_identification.model import compiling


def _compiled_anew() -> float:
    """Seconds that a function took which nothing has called before."""

    @njit
    def total(count):  # type: ignore[no-untyped-def]
        out = 0.0
        for i in range(count):
            out += float(i) ** 0.5
        return out

    start = time.monotonic()
    total(3)
    return time.monotonic() - start


def test_compiling_is_timed_once_however_deep() -> None:
    before = compiling.seconds()
    took = _compiled_anew()
    spent = compiling.seconds() - before
    assert 0.5 * took < spent <= took
    assert compiling.seconds() - before == spent


def test_compiling_is_not_counted_against_an_answer() -> None:
    start = time.monotonic()
    budget = Budget(seconds=1e9)
    _compiled_anew()
    time.sleep(0.05)
    wall = time.monotonic() - start
    counted = budget.elapsed()
    assert 0.05 <= counted < wall
    assert not budget.spent()
    assert Budget(seconds=-1.0).spent()
    assert not UNLIMITED.late()
