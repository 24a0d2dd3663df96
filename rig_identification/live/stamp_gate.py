"""Which samples of a live stream to believe by their stamps, and an account of the others."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Stamps = NDArray[np.int64]

SECOND = 1_000_000_000
#: A stamp may run ahead of the time that has passed by so much, ns: buffers empty in bursts.
AHEAD = SECOND
#: After so many rejected stamps that form a clock of their own, the device was restarted.
RESTART = 50
#: Intervals longer than this many median intervals are gaps.
GAP = 1.5
#: Weight of one interval in the running median interval's step.
_LEARNING = 0.02


@dataclass
class StampGate:
    """Lets through stamps that run forwards on one clock; counts what it turns away.

    Stamps that are zero, repeat, run backwards or leap ahead of the time that has passed are
    rejected one by one. When :data:`RESTART` rejected stamps in a row run forwards among
    themselves, the device's clock was set anew, and the gate follows it.
    """

    received: int = 0
    admitted: int = 0
    zero: int = 0
    duplicated: int = 0
    backward: int = 0
    ahead: int = 0
    restarts: int = 0
    gaps: int = 0
    missing: int = 0
    interval: float = 0.0  # ns, running median
    offset: float = float("nan")  # s, arrival less stamp, of the latest batch
    last_stamp: int = 0
    last_arrival: int = 0
    _strangers: list[int] = field(default_factory=list)

    @property
    def rejected(self) -> int:
        """Samples turned away."""
        return self.received - self.admitted

    @property
    def rate(self) -> float:
        """Hz, by the stamps."""
        return SECOND / self.interval if self.interval > 0.0 else 0.0

    def admit(self, stamp_ns: Stamps, arrival_ns: Stamps) -> NDArray[np.bool_]:
        """(n,) which samples of a batch to use; stamps and arrivals in ns, in the order of arrival."""
        count = len(stamp_ns)
        self.received += count
        if count == 0:
            return np.zeros(0, bool)
        mask = self._admit_all(stamp_ns, arrival_ns)
        if mask is None:
            mask = np.array(
                [self._admit_one(int(s), int(a)) for s, a in zip(stamp_ns, arrival_ns, strict=True)]
            )
        self.admitted += int(np.count_nonzero(mask))
        if mask.any():
            self.offset = float(np.median(arrival_ns[mask] - stamp_ns[mask])) / SECOND
        return mask

    def _admit_all(self, stamp_ns: Stamps, arrival_ns: Stamps) -> NDArray[np.bool_] | None:
        """All of a batch where nothing is odd, else None."""
        if self.last_stamp == 0 or self._strangers:
            return None
        steps = np.diff(stamp_ns, prepend=self.last_stamp)
        waits = np.diff(arrival_ns, prepend=self.last_arrival)
        if np.any(steps <= 0) or np.any(steps > np.maximum(waits, 0) + AHEAD):
            return None
        self._account(steps)
        self.last_stamp, self.last_arrival = int(stamp_ns[-1]), int(arrival_ns[-1])
        return np.ones(len(stamp_ns), bool)

    def _account(self, steps: Stamps) -> None:
        """Gaps against the running median interval."""
        if self.interval == 0.0:
            self.interval = float(np.median(steps))
        long = steps[steps > GAP * self.interval]
        self.gaps += len(long)
        self.missing += int(np.sum(np.round(long / self.interval) - 1)) if len(long) else 0
        above = np.count_nonzero(steps > self.interval) - np.count_nonzero(steps < self.interval)
        self.interval *= 1.0 + _LEARNING * above / len(steps)

    def _admit_one(self, stamp: int, arrival: int) -> bool:
        if stamp <= 0:
            self.zero += 1
            return False
        if self.last_stamp == 0:
            return self._follow_first(stamp, arrival)
        step = stamp - self.last_stamp
        if 0 < step <= max(arrival - self.last_arrival, 0) + AHEAD:
            self._strangers.clear()
            self._account(np.array([step]))
            self.last_stamp, self.last_arrival = stamp, arrival
            return True
        return self._turn_away(stamp, arrival, step)

    def _follow_first(self, stamp: int, arrival: int) -> bool:
        self.last_stamp, self.last_arrival = stamp, arrival
        return True

    def _turn_away(self, stamp: int, arrival: int, step: int) -> bool:
        if step == 0:
            self.duplicated += 1
        elif step < 0:
            self.backward += 1
        else:
            self.ahead += 1
        if self._strangers and not 0 < stamp - self._strangers[-1] <= AHEAD:
            self._strangers.clear()
        self._strangers.append(stamp)
        if len(self._strangers) < RESTART:
            return False
        self._strangers.clear()
        self.restarts += 1
        self.last_stamp, self.last_arrival = stamp, arrival
        return True
