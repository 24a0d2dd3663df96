"""A driver that polls a slow device: stamps lie on the lattice of its polls, values on that of the device.

Stamps alone do not tell a device that is polled from one that measures unevenly, as at every second or third
tick of a quicker clock. The values do (evenly.py).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Widths of a line in a spectrum within which a lattice is one of the samples themselves.
_OWN = 4.0
#: Steps in a lattice's period when its frequency is sought, and in a line's width.
_FINE, _WITHIN = 8, 2
#: A line as strong as the strongest: sinc(1/4)^2 is 0.8, what half of a bin beside it leaves.
_STRONG, _MULTIPLES = 0.8, 8


def lattice(times: Array, interval: float, least: float) -> tuple[float, float]:
    """Period (s) of the lattice on which stamps lie, and the nats for it against stamps at random.

    times: (n,) s; interval: s, of the samples, whose own lattice is left out; least: s, shortest period.
    """
    span, count = float(np.ptp(times)), len(times)
    width = least / _FINE
    bins = int(span / width) + 1 if least > 0.0 else 2**25
    if bins > 2**22 or interval <= 2.0 * least:
        return interval, 0.0
    size = 2 ** math.ceil(math.log2(_WITHIN * bins))
    counts = np.bincount(np.clip((times - times.min()) / width, 0, bins - 1).astype(np.int64), minlength=bins)
    frequency = np.arange(size // 2 + 1) / (size * width)
    own = np.abs(frequency - np.round(frequency * interval) / interval) < _OWN / span
    sought = (frequency > 1.0 / interval) & (frequency < 1.0 / least) & ~own
    power = np.where(sought, np.abs(np.fft.rfft(counts, size)) ** 2 / count, 0.0)
    best = int(np.argmax(power))
    # The multiples of a line are as strong: the first is the lattice's
    for part in range(_MULTIPLES, 1, -1):
        near = round(best / part) + np.arange(-1, 2)
        if np.max(power[near]) >= _STRONG * power[best]:
            best = int(near[np.argmax(power[near])])
            break
    # Of stamps at random the power is exponential with mean 1
    return 1.0 / float(frequency[max(best, 1)]), float(power[best]) - math.log(np.count_nonzero(sought) + 1)
