"""How far a miss of the published errors may lie in what the thesis does not print.

Not printed are the phase of a harmonic force and the sense in which it turns, which of two
neighbouring samples of moment goes with a step of rate, and whether the errors' sum of squares or
their determinant is minimised. The table keeps one reading for all cases; here the others are
tried as well, to tell a miss that a reading can explain from one that none of them does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.errors import InputError
from rig_identification.thesis.case import Case
from rig_identification.thesis.estimators import fit_euler_predictor
from rig_identification.thesis.force import HarmonicForce
from rig_identification.thesis_rerun.comparison import measured, signed_error
from rig_identification.thesis_rerun.motion import CaseMotion, fly_case

Array = NDArray[np.float64]

#: Phases, rad, that a harmonic force is tried with, and the sense it turns in.
TURNS = ((0.5 * np.pi, False), (np.pi, False), (1.5 * np.pi, False), (0.0, True))
#: Passes over a block of motion end at this change of force, N, and steps between nodes: the errors hold to
#: 1e-5 percentage points at a third of the time.
AGREED, SUBSTEPS = 1.0, 1
DIAGONAL = ("Jxx", "Jyy", "Jzz")


@dataclass(frozen=True)
class Readings:
    """Diagonal errors of (a) under every reading, percent, absolute."""

    published: Array  # (3,)
    tried: Array  # (k, 3); the table's own reading comes first
    harmonic: bool  # readings of a harmonic force are among them

    @property
    def nearest(self) -> float:
        """Percentage points between the published diagonal and that of the closest single reading."""
        return float(np.min(np.max(np.abs(self.tried - self.published), axis=1)))

    @property
    def outside(self) -> tuple[str, ...]:
        """Elements whose published error lies beyond every reading's."""
        low, high = self.tried.min(axis=0), self.tried.max(axis=0)
        beyond = (self.published < low) | (self.published > high)
        return tuple(name for name, out in zip(DIAGONAL, beyond, strict=True) if out)


def try_readings(motion: CaseMotion) -> Readings | None:
    """(a) under every reading of one case; None where nothing is published."""
    case = motion.case
    if case.published is None:
        return None
    rate, moment = measured(motion, motion.samples())
    middle = 0.5 * (moment[1:] + moment[:-1])
    tried = [
        _diagonal(case, rate, moment),
        _diagonal(case, rate, moment, criterion="sum"),
        _diagonal(case, rate[:-1], moment[1:]),
        _diagonal(case, rate[:-1], middle),
    ]
    others = _other_forces(case)
    tried += [_diagonal(case, *seen) for other in others if (seen := _seen(other)) is not None]
    return Readings(np.abs(np.diag(case.published.error)), np.array(tried), bool(others))


def _diagonal(case: Case, rate: Array, moment: Array, criterion: str = "determinant") -> Array:
    fit = fit_euler_predictor(rate, moment, case.sampling, case.initial_guess, criterion=criterion)
    return np.abs(np.diag(signed_error(case, fit.inertia)))


def _other_forces(case: Case) -> list[Case]:
    """The case with its harmonic force begun at other phases, or turning the other way."""
    segments = case.force.segments
    if not any(isinstance(segment, HarmonicForce) for segment in segments):
        return []
    cases = []
    for phase, backwards in TURNS:
        turned = tuple(
            replace(s, phase=phase, backwards=backwards) if isinstance(s, HarmonicForce) else s
            for s in segments
        )
        cases.append(replace(case, force=replace(case.force, segments=turned)))
    return cases


def _seen(case: Case) -> tuple[Array, Array] | None:
    try:
        motion = fly_case(case, agreed=AGREED, substeps=SUBSTEPS)
    except InputError:  # this reading's motion leaves every bound: it cannot be the thesis'
        return None
    return measured(motion, motion.samples())
