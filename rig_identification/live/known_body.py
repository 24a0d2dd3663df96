"""Mass and centre of mass while the rig runs: a guess, given ones, or the identifier's latest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.first_guess import extent, first_elements
from rig_identification.recording import Session
from rig_identification.rig import Rig

Array = NDArray[np.float64]

GUESS, GIVEN, IDENTIFIED = "a guess by the rig's size", "parameter", "identifier"


class KnownBody:
    """Mass and centre of mass with their standard deviations, and where they are from.

    Parameters
    ----------
    rig : Rig
        Its weighed mass and tolerance; unweighed, nothing is known but the mass' order of magnitude.
    center, center_std : (3,) or None
        m, body frame; a centre that is given stays.
    """

    def __init__(self, rig: Rig, center: Array | None = None, center_std: Array | None = None) -> None:
        guess = first_elements(Session("live", rig, ()))
        self.mass = float(guess[0])  # kg
        weighed = rig.mass is not None and rig.mass_std is not None
        self.mass_std = float(rig.mass_std or 0.0) if weighed else self.mass
        self.center = guess[1:4] if center is None else np.array(center, dtype=float)  # m, body frame
        # A body's centre lies somewhere within the box that its hinges span, or below it
        self.center_std = np.full(3, float(np.max(extent(rig))))
        self.center_from = GUESS if center is None else GIVEN
        if center is not None:
            self.center_std = np.zeros(3) if center_std is None else np.array(center_std, dtype=float)

    def identified(self, mass: float, center: Array) -> None:
        """The identifier's latest; NaN where it could not tell. Its doubts: see :meth:`doubted`."""
        if self.center_from == GIVEN or not np.all(np.isfinite(center)):
            return
        self.center, self.center_from = np.array(center, dtype=float), IDENTIFIED
        if np.isfinite(mass):
            self.mass = float(mass)

    def doubted(self, covariance: Array) -> None:
        """(10, 10) covariance of the identifier's latest, order m cx cy cz J; NaN where it could not tell."""
        if self.center_from == GIVEN:
            return
        variance = np.diagonal(covariance)[:4]
        if np.all(np.isfinite(variance)) and np.all(variance >= 0.0):
            self.mass_std, self.center_std = float(np.sqrt(variance[0])), np.sqrt(variance[1:])
