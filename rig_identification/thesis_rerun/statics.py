"""Table 2.1, rerun: the centre of mass from the bare and the dummy experiment."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.recording import Dummy
from rig_identification.statics import (
    Equilibrium,
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
    poses: tuple[int, ...]  # in which the bare body, and the one with its dummy, can hang
    statement: str  # the solver's, on the poses and the centre of mass that explain the readings
    std: Array  # (3,) with a real inclinometer and a rig to ordinary tolerances
    std_inclinometer: Array  # (3,) with the same inclinometer on a rig as described
    std_with_tensions: Array  # (3,) load cells beside it

    @property
    def worst(self) -> float:
        """Largest error of ``found``, m."""
        return float(np.max(np.abs(self.found - self.actual)))


def rerun_statics() -> StaticRerun:
    """Hang the body of Table 2.1 bare and with its dummy, and solve for its centre of mass."""
    case = load_static_case()
    exact = replace(case, rig=replace(case.rig, tolerance=dict.fromkeys(case.rig.tolerance, 0.0)))
    ideal = _solved(case, 0.0, None)
    found, _ = _body(case, ideal)
    std, by_inclinometer, sharper = (
        _body(which, _solved(which, INCLINATION, tension))[1]
        for which, tension in ((case, None), (exact, None), (case, TENSION))
    )
    poses = tuple(len(_hung(case, dummy)) for dummy in (None, case.dummy))
    return StaticRerun(
        case.actual, case.calculated, found @ TURN, poses, ideal.statement, std, by_inclinometer, sharper
    )


def _hung(case: StaticCase, dummy: Dummy | None) -> tuple[Equilibrium, ...]:
    """Every pose in which the body hangs."""
    if case.rig.mass is None:
        raise AssertionError("the table prints the masses")
    return find_equilibria(case.rig, case.rig.mass, case.combined, dummy).equilibria


def _solved(case: StaticCase, inclination: float, tension: float | None) -> StaticSolution:
    seen = []
    for name, dummy in (("bare", None), ("dummy", case.dummy)):
        rest = _hung(case, dummy)[0]
        seen.append(observe_equilibrium(case.rig, rest, name, dummy, inclination, tension))
    return solve_center_of_mass(case.rig, *seen)


def _body(case: StaticCase, solution: StaticSolution) -> tuple[Array, Array]:
    """Centre of mass without the frame and its standard deviations."""
    if case.rig.frame is None:
        raise AssertionError("the table prints a carrying frame")
    _, center, covariance = without_frame(solution, case.rig.frame)
    return center, np.sqrt(np.diag(covariance))
