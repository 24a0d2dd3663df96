"""What a session knows of the body and of its rig together: enough to combine it with other sessions.

Ten numbers and their covariance do not say which of their errors another session shares. A load cell that
reads 0.05 % high does so in every session of its rig. The joint information of body and doubts says it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import CarryingFrame

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Doubt:
    """One number of the rig that the lab knows within a tolerance, as the fit found it."""

    name: str  # "cable_1.length", "imu.gyroscope_scale.x", ...
    unit: str
    nominal: float  # what the description says
    prior_std: float  # tolerance; of a positive number that of its logarithm
    at: float  # where the fit found it: distance from the nominal in units of prior_std


@dataclass(frozen=True)
class Weighing:
    """What a ground scale said of body and carrying frame together."""

    mass: float  # kg
    std: float  # kg


@dataclass(frozen=True)
class JointInformation:
    """Gaussian (Laplace) posterior of body and doubts at a fit's optimum, with the priors that are in it.

    The unknowns are z = (x, p): x (10,) the body in the order of ``result.ELEMENTS`` in SI units, p (K,) the
    doubts, each in units of its tolerance. Start states and everything else are integrated out.
    """

    elements: Array  # (10,) x at the optimum
    doubts: tuple[Doubt, ...]  # K
    root: Array  # (10 + K, 10 + K) upper triangular; root.T @ root is the information, priors included
    weak: Array  # (10, 10) information on x that the fit's weak prior on the body contributes
    weak_gradient: Array  # (10,) its cost's gradient at the optimum
    belief: Array  # (10,) std of what one would believe of such a body on such a rig without recordings
    weighing: Weighing | None = None
    frame: CarryingFrame | None = None
    ceiling: Mapping[str, Array] = field(default_factory=dict)  # cable -> (3,) m, world, as described
    mounts: Mapping[str, Array] = field(default_factory=dict)  # device -> (7,) position m, quaternion xyzw
    start_ns: int = 0  # first stamp of the session
