"""Table 2.1, rerun: the centre of mass from the bare and the dummy experiment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig_identification.statics import (
    StaticSolution,
    find_equilibria,
    observe_equilibrium,
    solve_center_of_mass,
    without_frame,
)
from rig_identification.thesis.static_case import TURN, StaticCase, load_static_case

Array = NDArray[np.float64]

#: Standard errors of the means of a recording at rest: inclinometer, rad, and load cell, N.
INCLINATION, TENSION = 1e-5, 0.5


@dataclass(frozen=True)
class StaticRerun:
    """The centre of mass of the test body, in the table's axes (z down), m."""

    actual: Array  # (3,) printed
    published: Array  # (3,) what the thesis calculates
    found: Array  # (3,) without noise, nothing given but inclinations, lengths and masses
    std: Array  # (3,) with a real inclinometer and a rig to ordinary tolerances
    std_with_tensions: Array  # (3,) load cells beside it

    @property
    def worst(self) -> float:
        """Largest error of ``found``, m."""
        return float(np.max(np.abs(self.found - self.actual)))


def rerun_statics() -> StaticRerun:
    """Hang the body of Table 2.1 bare and with its dummy, and solve for its centre of mass."""
    case = load_static_case()
    found, _ = _body(case, _solved(case, 0.0, None))
    _, std = _body(case, _solved(case, INCLINATION, None))
    _, sharper = _body(case, _solved(case, INCLINATION, TENSION))
    return StaticRerun(case.actual, case.calculated, found @ TURN, std, sharper)


def _solved(case: StaticCase, inclination: float, tension: float | None) -> StaticSolution:
    rig, mass = case.rig, case.rig.mass
    if mass is None:
        raise AssertionError("the table prints the masses")
    seen = []
    for name, dummy in (("bare", None), ("dummy", case.dummy)):
        rest = find_equilibria(rig, mass, case.combined, dummy).equilibria[0]
        seen.append(observe_equilibrium(rig, rest, name, dummy, inclination, tension))
    return solve_center_of_mass(rig, *seen)


def _body(case: StaticCase, solution: StaticSolution) -> tuple[Array, Array]:
    """Centre of mass without the frame and its standard deviations."""
    if case.rig.frame is None:
        raise AssertionError("the table prints a carrying frame")
    _, center, covariance = without_frame(solution, case.rig.frame)
    return center, np.sqrt(np.diag(covariance))
