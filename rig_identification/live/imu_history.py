"""The IMU's last seconds: how the body turned since an instant, and what a hole in the samples may hide."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Samples kept: seconds of the fastest IMU.
KEPT = 4096
#: The usual interval is looked at anew once in so many samples.
OFTEN = 50
#: s: a hole is bridged only by what twice its length of motion, and so much at least, tells of it.
LEAST_SPAN = 0.5


class ImuHistory:
    """Stamps, angular rates and specific forces of the latest samples, body axes as measured."""

    def __init__(self) -> None:
        self._stamp = np.zeros(2 * KEPT, np.int64)
        self._values = np.zeros((2 * KEPT, 6))
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._count = 0
        self.interval = float("inf")  # s, usual one between two samples; infinite before the third

    def add(self, stamp_ns: int, rate: Array, force: Array) -> None:
        """The newest sample."""
        if self._count == 2 * KEPT:
            self._stamp[:KEPT], self._values[:KEPT] = self._stamp[KEPT:], self._values[KEPT:]
            self._count = KEPT
        self._stamp[self._count] = stamp_ns
        self._values[self._count, :3] = rate
        self._values[self._count, 3:] = force
        self._count += 1
        if self._count % OFTEN == 3:
            self.interval = float(np.median(np.diff(self._stamps[-2 * OFTEN :]))) / 1e9

    @property
    def _stamps(self) -> NDArray[np.int64]:
        return self._stamp[: self._count]

    def turned_since(self, stamp_ns: int, bias: Array) -> Array:
        """(3,) rad: rotation vector from the body at an instant within the history to the body at its end.

        The rate's integral, ``bias`` rad/s taken off: exact for a turn about one axis, and off by less than
        a twelfth of the square of its angle (coning) for a fraction of a swing.
        """
        first = max(int(np.searchsorted(self._stamps, stamp_ns, side="right")) - 1, 0)
        time = (self._stamps[first:] - stamp_ns) / 1e9
        rate = self._values[first : self._count, :3] - bias
        if len(time) == 1:
            return np.zeros(3)
        steps = np.diff(time)
        turn = steps @ (0.5 * (rate[1:] + rate[:-1]))
        # The first interval begins before the instant
        early = -time[0]
        return np.asarray(turn - early * (rate[0] + 0.5 * early / steps[0] * (rate[1] - rate[0])))

    def hidden_in(self, hole: float) -> Array | None:
        """(6,) rms of what the mean over ``hole`` s differed by from that of its ends; None: nobody knows.

        So much may the body have done unseen, if it moves as it did before.
        """
        time = (self._stamps - (self._stamps[-1] if self._count else 0)) / 1e9
        if self._count < 3 or -time[0] < max(LEAST_SPAN, 2.0 * hole):
            return None
        values = self._values[: self._count]
        steps = np.diff(time)[:, None]
        integral = np.concatenate(
            [np.zeros((1, 6)), np.cumsum(steps * 0.5 * (values[1:] + values[:-1]), axis=0)]
        )
        starts = np.arange(time[0], -hole, 0.25 * hole)
        begin, end = np.searchsorted(time, starts), np.searchsorted(time, starts + hole)
        end = np.minimum(end, self._count - 1)
        mean = (integral[end] - integral[begin]) / np.maximum(time[end] - time[begin], 1e-9)[:, None]
        missed = mean - 0.5 * (values[begin] + values[end])
        return np.asarray(np.sqrt(np.mean(missed**2, axis=0)))
