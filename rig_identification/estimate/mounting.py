"""A device on a soft mount: it moves as a mass on a damped spring does whose foot the body shakes.

Of what the body does, u, the device shows y = u + g with
    G(s) = -s^2/(s^2 + 2 z w s + w^2),    k = 1/w^2,
w the mount's natural angular frequency and z its damping ratio. Far below resonance y = u - k d2u/dt2: a
swing at angular frequency W looks too large by (W/w)^2. k = 0 is a rigid mount; a fit may pass through
negative k, where that first order is continued, and a mount that rings faster than the nodes tell is taken to
first order as well. Only g is filtered, by straight lines between nodes: u itself is not cut at its peaks.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter, lfilter_zi

Array = NDArray[np.float64]

#: Damping ratio below which no mount is: a steel bell's.
LEAST_DAMPING = 0.002
#: Turn w h of the mount from one node to the next up to which it is followed: the kinks of straight lines
#: ring at w, and cancel where several nodes share a period.
FOLLOWED = 1.0
#: Share of k by which it is moved to tell the answer's derivative, and so much of z.
MOVED = 1e-3


def mounted(step: float, k: float, damping: float, values: Array) -> Array:
    """What a device on a mount of ``k`` (s^2) shows of ``values`` (N, c), ``step`` seconds apart."""
    if k == 0.0:
        return values
    if not _rings(step, k):
        return np.asarray(values - k * _second(step, values))
    w, z = 1.0 / np.sqrt(k), max(damping, LEAST_DAMPING)
    b, a, _ = cont2discrete(([-1.0, 0.0, 0.0], [1.0, 2.0 * z * w, w * w]), step, method="foh")
    b = np.ravel(b)
    # It has hung still with what it shows at first
    rest = lfilter_zi(b, a)[:, None] * values[:1]
    return np.asarray(values + lfilter(b, a, values, axis=0, zi=rest)[0])


def mounted_change(step: float, k: float, damping: float, values: Array) -> tuple[Array, Array]:
    """Derivatives of :func:`mounted` in ``k`` and in ``damping``, each (N, c)."""
    if not _rings(step, k):
        return -_second(step, values), np.zeros_like(values)
    own, other = MOVED * k, MOVED * max(damping, LEAST_DAMPING)
    in_k = mounted(step, k + own, damping, values) - mounted(step, k - own, damping, values)
    in_damping = mounted(step, k, damping + other, values) - mounted(step, k, damping - other, values)
    return in_k / (2.0 * own), in_damping / (2.0 * other)


def _rings(step: float, k: float) -> bool:
    return k > 0.0 and step <= FOLLOWED * float(np.sqrt(k))


def _second(step: float, values: Array) -> Array:
    """(N, c) second derivative of ``values``; at the ends that of their neighbours."""
    if values.shape[0] < 3:
        return np.zeros_like(values)
    inside = np.diff(values, 2, axis=0) / step**2
    return np.concatenate([inside[:1], inside, inside[-1:]])
