"""A search under way: how long it takes at most, and the numbers so far."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from rig_identification.cli.batch_progress import duration
from rig_identification.cli.plain_numbers import plain_number
from rig_identification.cli.progress import StageProgress
from rig_identification.model.work import BEYOND, UNIT, meter
from rig_identification.report.ten_numbers import elements
from rig_identification.result import Identification

#: s of a search before its speed says how long it will take, and the step in which seconds are told.
MEASURED, STEP = 5.0, 10.0
#: Share of the work by which the speed is known: what comes before is reading and compiling mostly.
KNOWN = 0.02
#: Elements that are told while a search runs: mass and the three moments.
SHOWN = ("m", "Jxx", "Jyy", "Jzz")


class Searching:
    """Progress of ``identify``: names stages, and beside them the time that is left at most.

    A search ends where nothing is left to explain, mostly long before its limit of work: the time is a bound.
    Call :meth:`better` with each better answer.

    Parameters
    ----------
    shown : StageProgress
    limit : float
        Units of work after which the search begins nothing new.
    clock : callable
        Seconds, monotonic.
    done : callable
        Work until now, in units.
    """

    def __init__(
        self,
        shown: StageProgress,
        limit: float,
        clock: Callable[[], float] = time.monotonic,
        done: Callable[[], float] = lambda: meter().done / UNIT,
    ) -> None:
        self._shown, self._limit, self._clock, self._done = shown, limit, clock, done
        self._begin: float | None = None
        self._so_far = ""

    def __call__(self, stage: str, fraction: float | None = None) -> None:
        """Report a stage and the fraction of it that is done, 0 to 1."""
        if self._begin is None:
            self._begin = self._clock()
        self._shown(stage, fraction, self._left())

    def better(self, answer: Identification) -> None:
        """Show the numbers of a better answer, if they are others than those shown last."""
        told = so_far(answer)
        if told != self._so_far:
            self._so_far = told
            self._shown.say(f"so far: {told}")

    def _left(self) -> str:
        """Time left at most, once the speed is known; "" before."""
        done = self._done()
        elapsed = 0.0 if self._begin is None else self._clock() - self._begin
        if elapsed < MEASURED or done < KNOWN * self._limit:
            return ""
        left = max((1.0 + BEYOND) * self._limit - done, 0.0) * elapsed / done
        return f"at most {_time(left)} left"


def _time(seconds: float) -> str:
    """Seconds up to a minute, rounded up; then minutes."""
    steps = math.ceil(seconds / STEP)
    return f"{STEP * steps:.0f} s" if STEP * steps <= 60.0 else duration(seconds)


def so_far(answer: Identification) -> str:
    """Mass and moments with their 95 % intervals, and what is in the model, in a line."""
    body = answer.without_frame or answer.total
    parts = [
        f"{e.symbol}{e.index} {plain_number(e.value)} ± {plain_number(e.half_width)} {e.unit}"
        for e in elements(body)
        if e.observable and e.symbol + e.index in SHOWN
    ]
    effects = ", ".join(dict.fromkeys(f.effect for f in answer.mismatch.findings))
    return ", ".join(parts) + (f"; with {effects}" if effects else "")
