"""One answer from several models that the recordings hardly tell apart.

Two models may fit alike and make another body of it. The likeliest one's own interval knows nothing of that;
the mixture of all, each weighed by how likely it is, does (Hoeting, Madigan, Raftery & Volinsky, Bayesian
model averaging, Statistical Science 14, 1999):
    x = sum w_i x_i,   C = sum w_i (C_i + (x_i - x)(x_i - x)')

How likely is itself not known to the nat: evidence charges each parameter for the width of its prior, which
is a guess within about a factor of ten, and a gap between two has two such guesses in it. Averaged over that
(normal, of std DOUBT nats) the odds are nearer to even, about as those of a gap that is
sqrt(1 + pi DOUBT^2 / 8) times smaller (MacKay, Neural Computation 4, 1992, The evidence framework applied to
classification networks).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.result import InertialEstimate

Array = NDArray[np.float64]
#: What other models make of a body, each with the nats by which it trails the likeliest.
Bodies = Sequence[tuple[float, InertialEstimate]]

#: Std (nats) of a difference of two log evidences: a factor of ten in either's prior.
DOUBT = float(np.hypot(np.log(10.0), np.log(10.0)))


def weights(gaps: Sequence[float]) -> Array:
    """(1 + n,) how likely the likeliest model and n others are. gaps: nats by which each of them trails."""
    trailing = np.array([0.0, *gaps]) / np.sqrt(1.0 + np.pi * DOUBT**2 / 8.0)
    odds = np.exp(np.min(trailing) - trailing)
    return np.asarray(odds / np.sum(odds))


def mixture(first: InertialEstimate, others: Bodies) -> InertialEstimate:
    """The likeliest model's estimate with those of ``others`` mixed in, each with the nats it trails by."""
    all_of_them = [first, *(estimate for _, estimate in others)]
    share = weights([gap for gap, _ in others])
    mean = sum(w * e.values for w, e in zip(share, all_of_them, strict=True))
    covariance = sum(
        w * (e.covariance + np.outer(e.values - mean, e.values - mean))
        for w, e in zip(share, all_of_them, strict=True)
    )
    return replace(first, values=np.asarray(mean), covariance=np.asarray(covariance))
