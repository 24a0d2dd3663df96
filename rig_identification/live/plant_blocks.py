"""Motion of a simulated plant in blocks, and what a device samples of it on its own clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlantBlock:
    """Raw outputs of the forward model and the exciter's force at equidistant nodes."""

    start_ns: int  # time of the first node
    step: float  # s
    rows: Array  # (N, 18 + n + 3): outputs as in model/layout.py, then exciter force in its frame, N

    @property
    def end_ns(self) -> int:
        """Time of the last node."""
        return self.start_ns + round(1e9 * self.step * (len(self.rows) - 1))


class DeviceSampler:
    """Samples blocks at a device's rate: straight lines between nodes, none lost between blocks."""

    def __init__(self, rate: float) -> None:
        self._interval_ns = 1e9 / rate
        self._first_ns: int | None = None
        self._taken = 0

    def sample(self, block: PlantBlock) -> tuple[NDArray[np.int64], Array]:
        """Times (k,) ns and rows (k, w) of the samples that fall into a block, its last node excluded."""
        if self._first_ns is None or block.start_ns < self._next_ns() - 10 * self._interval_ns - 1e9:
            self._first_ns, self._taken = block.start_ns, 0
        behind = (block.start_ns - self._first_ns) / self._interval_ns
        first = max(self._taken, int(np.ceil(behind - 1e-9)))
        last = int(np.ceil((block.end_ns - self._first_ns) / self._interval_ns - 1e-9))
        if last <= first:
            return np.zeros(0, np.int64), np.zeros((0, block.rows.shape[1]))
        self._taken = last
        times = self._first_ns + np.round(np.arange(first, last) * self._interval_ns).astype(np.int64)
        place = np.clip((times - block.start_ns) / (1e9 * block.step), 0.0, len(block.rows) - 1.0)
        left = np.minimum(place.astype(np.int64), len(block.rows) - 2)
        weight = (place - left)[:, None]
        return times, np.asarray((1.0 - weight) * block.rows[left] + weight * block.rows[left + 1])

    def _next_ns(self) -> float:
        return (self._first_ns or 0) + self._taken * self._interval_ns
