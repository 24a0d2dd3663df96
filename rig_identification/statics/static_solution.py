"""What chapter 2 answers: the centre of mass, the poses, and a status that says how far to trust it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.rig import CarryingFrame

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StaticPose:
    """Where the body hung in one recording."""

    name: str
    position: Array  # (3,) m, body origin in world
    orientation: Array  # (4,) quaternion xyzw, rotates body vectors into world
    tension: Array  # (n,) N; NaN where open
    tension_std: Array  # (n,) N; infinite where open
    undetermined_tensions: int  # combinations that lengths and balance leave open


@dataclass(frozen=True)
class StaticSolution:
    """The centre of mass and how well it is known.

    ``status``: ``"determined"``; ``"undetermined"``, the elements of ``undetermined`` are
    open; ``"ambiguous"``, ``alternatives`` fit as well; ``"slack"``, a cable would have to push;
    ``"inconsistent"``, readings and description do not agree within their noise;
    ``"no_pose"``, no pose has these inclinations and lengths (then nothing else is given).
    """

    status: str
    statement: str
    center_of_mass: Array  # (3,) m, body; NaN where undetermined
    covariance: Array  # (3, 3) m^2; infinite variance where undetermined
    mass: float  # kg, all but dummies
    mass_std: float  # kg
    undetermined: tuple[str, ...] = ()
    poses: tuple[StaticPose, ...] = ()
    chi_squared: float = float("nan")
    degrees_of_freedom: int = 0
    alternatives: tuple[StaticSolution, ...] = ()

    @property
    def std(self) -> Array:
        """(3,) m, one standard deviation of the centre of mass."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def without_frame(solution: StaticSolution, frame: CarryingFrame) -> tuple[float, Array, Array]:
    """Mass (kg), centre of mass (3,) m and its covariance without the carrying frame, taken as exact."""
    mass = solution.mass - frame.mass
    center = (solution.mass * solution.center_of_mass - frame.mass * frame.center_of_mass) / mass
    by_mass = (solution.center_of_mass - center) / mass
    covariance = (solution.mass / mass) ** 2 * solution.covariance
    return mass, center, covariance + solution.mass_std**2 * np.outer(by_mass, by_mass)
