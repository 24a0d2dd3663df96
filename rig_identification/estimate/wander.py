"""Zeros that are a little other ones in each recording, as every device's are.

A description states how far a zero may be off (its tolerance). One number for all recordings would have it
come back to a thousandth of that: so well is the mean of half a minute known. Amplifiers, bridges and
gyroscopes do not; their zeros return to a part of what they may be off. A held-out run whose gyroscope stands
3e-5 rad/s elsewhere would refute any model.

So each run has a deviation of its own from each zero, N(0, s^2), which no fit asks for: it is noise. The zero
itself is that of the recordings at rest, whose means scatter as their blocks do (rest_evidence.py).
With B the whitened responses of a run's rows to a std of each, the residuals' covariance is 1 + B B^T, and
    (1 + B B^T)^(-1/2) = 1 - B M B^T,   M = V diag((1 - (1 + l)^(-1/2)) / l) V^T,   B^T B = V diag(l) V^T
whitens them once more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: By which part of its tolerance a zero differs from recording to recording: repeatability in data sheets of
#: load cells and of MEMS gyroscopes and accelerometers is 3 to 20 % of the zero error that they state.
WANDER = 0.1
#: Tolerance of each quantity's zero.
ZEROS = {
    "tension": "load_cell_zero",
    "angular_rate": "gyroscope_bias",
    "specific_force": "accelerometer_bias",
    "inclination": "inclinometer_orientation",
}


def wander_of(rig: Rig, quantity: str) -> float:
    """Std of a recording's own deviation from a quantity's zero, in its unit; 0 where it has none."""
    name = ZEROS.get(quantity)
    return 0.0 if name is None else WANDER * rig.tolerance[name]


class Wander(NamedTuple):
    """How whitened columns of a run are whitened once more."""

    responses: Array  # (m, z) of each row to a std of each deviation
    weights: Array  # (z, z)

    def without(self, columns: Array) -> Array:
        """Columns (m, c) less what the deviations account for."""
        return np.asarray(columns - self.responses @ (self.weights @ (self.responses.T @ columns)))


def wander(responses: Array) -> tuple[Wander, float]:
    """What deviations with whitened ``responses`` (m, z) do, and the log std that they add."""
    values, V = np.linalg.eigh(responses.T @ responses)
    values = np.maximum(values, 0.0)
    # The limit at 0 is 1/2
    shares = np.where(values > 1e-6, (1.0 - 1.0 / np.sqrt(1.0 + values)) / np.maximum(values, 1e-6), 0.5)
    return Wander(responses, (V * shares) @ V.T), 0.5 * float(np.sum(np.log1p(values)))
