"""Amounts that a run's rows may be off by, integrated out: what is left is whitened once more.

Each amount has a unit normal prior and is a run's own; no fit asks for it. With B the responses of whitened
rows to a std of each, the rows' covariance is 1 + B B^T, and
    (1 + B B^T)^(-1/2) = 1 - B M B^T,   M = V diag((1 - (1 + l)^(-1/2)) / l) V^T,   B^T B = V diag(l) V^T
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Marginal(NamedTuple):
    """How whitened columns are whitened once more."""

    responses: Array  # (m, z) of each row to a std of each amount
    weights: Array  # (z, z)

    def without(self, columns: Array) -> Array:
        """Columns (m, c) less what the amounts account for."""
        return np.asarray(columns - self.responses @ (self.weights @ (self.responses.T @ columns)))

    def back(self, columns: Array) -> Array:
        """Inverse of :meth:`without`: columns (m, c) as they are beside these amounts.

        With W = (1 + B B^T)^(-1/2) it is W (1 + B B^T).
        """
        return self.without(columns + self.responses @ (self.responses.T @ columns))

    @property
    def taken(self) -> Array:
        """(z, z) N of the amounts' share in what columns have in common: W^2 = 1 - B N B^T."""
        size = self.responses.shape[1]
        return np.asarray(np.linalg.inv(np.eye(size) + self.responses.T @ self.responses))


def marginal(responses: Array) -> tuple[Marginal, float]:
    """What amounts with whitened ``responses`` (m, z) do, and what they add to the sum of log std."""
    values, V = np.linalg.eigh(responses.T @ responses)
    values = np.maximum(values, 0.0)
    # The limit at 0 is 1/2
    shares = np.where(values > 1e-6, (1.0 - 1.0 / np.sqrt(1.0 + values)) / np.maximum(values, 1e-6), 0.5)
    return Marginal(responses, (V * shares) @ V.T), 0.5 * float(np.sum(np.log1p(values)))
