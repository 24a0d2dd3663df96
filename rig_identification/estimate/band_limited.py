"""Noise that is white up to a frequency and no further: the error that a spline keeps of a smooth force.

Of white noise a penalised spline of fourth differences keeps 1/(1 + (f/c)^8)^2 of the power at f
(smooth_force.py). For a filter that follows such noise it has to be in state space. Here it is white noise
through four poles (Chebyshev's of the second kind: scipy.signal.cheby2), which comes nearest to it:

    f/c       0.5     0.75    0.9     1       1.1     1.25    1.5     1.7     2
    kept      0.992   0.826   0.489   0.250   0.101   0.021   1e-3    2e-4    2e-5
    here      1.009   0.821   0.442   0.223   0.100   0.027   3e-3    3e-4    2e-4

and is as steady as what it stands for. A line or a cubic between draws, some a second, is neither: at one
time more is claimed than at another, and each frequency below c has its image above. Where the force is most
of what load cells read, as under cables that splay, that is heard as a force of its own.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_continuous_lyapunov
from scipy.signal import cheby2, tf2ss

Array = NDArray[np.float64]

#: Poles of the filter, dB that it leaves of what is beyond its edge, and that edge in c.
POLES, STOP, EDGE = 4, 40.0, 1.75


def highest_cutoff(step: float) -> float:
    """Highest c (Hz) that nodes ``step`` s apart can hold the noise of."""
    return 0.99 / (2.0 * EDGE * step)


@cache
def shaping(cutoff: float, step: float) -> tuple[Array, Array]:
    """Noise that is white up to ``cutoff`` Hz, at nodes ``step`` s apart, in state space.

    (4, 4) how the state goes on, (4,) how it is read. A state of unit variances keeps them if what is new at
    each node brings it back to them, and is then read as noise whose power at low frequencies is that of
    white noise of unit variance at the nodes.
    """
    # What passes at once, a hundredth, is left out
    A, B, C, _ = tf2ss(*cheby2(POLES, STOP, EDGE, analog=True))
    C = C / (-C @ np.linalg.solve(A, B))
    root = np.linalg.cholesky(solve_continuous_lyapunov(A, -B @ B.T))
    per_node = 2.0 * np.pi * cutoff * step
    follow = np.linalg.solve(root, expm(per_node * A) @ root)
    return np.ascontiguousarray(follow), np.asarray(np.sqrt(per_node) * (C @ root)[0])
