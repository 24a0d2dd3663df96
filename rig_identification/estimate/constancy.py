"""Do held-out runs ask for the parameters that were fitted, to within what both know of them?

A model that lacks something may bend its parameters until every residual of the fitted runs is noise. Bent
parameters do not carry over: another motion asks for others. The held-out run's likelihood about the fit, its
start integrated out, is a quadratic in the parameters with information A and gradient b; the fit knows
them with information S. Where the model holds, b ~ N(0, A + A S^-1 A). In the generalised eigenvectors
of A against S (A u = l S u, u^T S u = 1) that is u^T b ~ N(0, l + l^2), each direction by itself, and
    T = sum (u^T b)^2 / (l + l^2) ~ chi^2(directions).
It is the test of constant parameters of econometrics (Chow, "Tests of equality between sets of
coefficients in two linear regressions", Econometrica 28, 1960), with priors. No residual need look
like anything but noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.stats import chi2

from rig_identification.estimate.prediction import Linearised
from rig_identification.model.definite import definite

Array = NDArray[np.float64]

#: Information of the held-out run, in parts of the fit's, below which a direction is no comparison.
COMPARED = 0.1


@dataclass(frozen=True)
class Departure:
    """How far a held-out run's parameters lie from the fitted ones."""

    recording: str
    statistic: float  # sum of squared deviations, each in its own std
    directions: int

    @property
    def log10_p(self) -> float:
        """Log10 of the chance of as much where the model holds."""
        if self.directions == 0:
            return 0.0
        return float(chi2.logsf(self.statistic, self.directions)) / float(np.log(10.0))

    @property
    def excess(self) -> float:
        """Variance of the deviations over what it should be; at least 1."""
        return max(1.0, self.statistic / max(1, self.directions))


def _directions(fitted: Array, full: Linearised) -> tuple[Array, Array, Array]:
    """Of each generalised eigenvector u its l and u^T b, (p,) each, and the residual in the run's starts."""
    size = fitted.shape[0]
    columns, starts = full.jacobian[:, :size], full.jacobian[:, size:]
    basis = np.linalg.qr(starts)[0]
    columns = columns - basis @ (basis.T @ columns)
    # A fit that is nowhere near knows some combinations to more digits than there are
    values, vectors = eigh(columns.T @ columns, definite(fitted))
    return values, vectors.T @ (columns.T @ full.residual), basis.T @ full.residual


def log_predictive(fitted: Array, full: Linearised) -> float:
    """Log density (nats) of one held-out run after the fit, less what any model has of it.

    Arguments as :func:`departure` has them. With the run's start integrated out, parameters N(theta, S^-1):
        - cost + 1/2 sum [(u^T b)^2 / (1 + l) - log(1 + l)],
    what the fit leaves open being charged and fitted alike. The difference of two models' is the log Bayes
    factor that the run adds to what they were fitted to.
    """
    values, pulls, own = _directions(fitted, full)
    values = np.maximum(values, 0.0)
    won = float(own @ own) + float(np.sum(pulls**2 / (1.0 + values) - np.log1p(values)))
    return 0.5 * won - full.cost


def departure(name: str, fitted: Array, full: Linearised) -> Departure:
    """Of one held-out run.

    fitted (p, p): the fit's information with its starts integrated out. full: the run linearised there.
    """
    values, pulls, _ = _directions(fitted, full)
    compared = values > COMPARED
    spread = values[compared] + values[compared] ** 2
    return Departure(name, float(np.sum(pulls[compared] ** 2 / spread)), int(np.count_nonzero(compared)))
