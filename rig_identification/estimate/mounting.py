"""A device that answers as a mass on a damped spring does: on a soft mount, or within its own case.

Of what the body does, u, the device shows y = u + g with
    G(s) = -(s^2 + T w^2 s)/(s^2 + 2 z w s + w^2),    k = 1/w^2,
w the natural angular frequency, z the damping ratio and T a delay. Where the damper stands on the body, as
rubber under a device does, T = 0. Where it does not, as in the seismic mass of an accelerometer or a filter
of second order behind it, T = 2 z/w and y/u = w^2/(s^2 + 2 z w s + w^2). Far below resonance
y = u - T du/dt - k d2u/dt2: a swing at angular frequency W looks too large by (W/w)^2, and late by T. k = 0
is a rigid mount; a fit may pass through negative k, where that first order is continued, and a mount that
rings faster than the nodes tell is taken to first order as well. Only g is filtered, by straight lines
between nodes: u itself is not cut at its peaks.
"""

from __future__ import annotations

from typing import NamedTuple

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


class Answer(NamedTuple):
    """The three numbers of such an answer."""

    k: float = 0.0  # 1/w^2, s^2
    damping: float = 0.0  # z
    delay: float = 0.0  # T, s


def mounted(step: float, answer: Answer, values: Array) -> Array:
    """What a device that answers so shows of ``values`` (N, c), ``step`` seconds apart."""
    k, damping, delay = answer
    if k == 0.0 and delay == 0.0:
        return values
    if not _rings(step, k):
        return np.asarray(values - k * _second(step, values) - delay * _first(step, values))
    w, z = 1.0 / np.sqrt(k), max(damping, LEAST_DAMPING)
    b, a, _ = cont2discrete(([-1.0, -delay * w * w, 0.0], [1.0, 2.0 * z * w, w * w]), step, method="foh")
    b = np.ravel(b)
    # It has hung still with what it shows at first
    rest = lfilter_zi(b, a)[:, None] * values[:1]
    return np.asarray(values + lfilter(b, a, values, axis=0, zi=rest)[0])


def mounted_change(step: float, answer: Answer, values: Array) -> tuple[Array, Array, Array]:
    """Derivatives of :func:`mounted` in ``k``, ``damping`` and ``delay``, each (N, c)."""
    k, damping, _ = answer
    in_delay = mounted(step, answer._replace(delay=1.0), values) - mounted(
        step, answer._replace(delay=0.0), values
    )
    if not _rings(step, k):
        return -_second(step, values), np.zeros_like(values), in_delay
    own, other = MOVED * k, MOVED * max(damping, LEAST_DAMPING)

    def between(less: Answer, more: Answer, by: float) -> Array:
        return np.asarray((mounted(step, more, values) - mounted(step, less, values)) / by)

    in_k = between(answer._replace(k=k - own), answer._replace(k=k + own), 2.0 * own)
    softer, harder = answer._replace(damping=damping - other), answer._replace(damping=damping + other)
    return in_k, between(softer, harder, 2.0 * other), in_delay


def _rings(step: float, k: float) -> bool:
    return k > 0.0 and step <= FOLLOWED * float(np.sqrt(k))


def _second(step: float, values: Array) -> Array:
    """(N, c) second derivative of ``values``; at the ends that of their neighbours."""
    if values.shape[0] < 3:
        return np.zeros_like(values)
    inside = np.diff(values, 2, axis=0) / step**2
    return np.concatenate([inside[:1], inside, inside[-1:]])


def _first(step: float, values: Array) -> Array:
    """(N, c) first derivative of ``values``."""
    if values.shape[0] < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values, step, axis=0))
