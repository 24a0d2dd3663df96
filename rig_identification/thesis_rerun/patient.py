"""The thesis as a patient: a session of case 14 in full physics, examined with the thesis' assumptions.

The thesis' equations lack the gyroscopic term w x (J w), and the mass of the exciter's motor, which rides on
the body, is in none of its bodies. A session of case 14 is simulated with both, with the noise of good
industrial sensors on a rig as described. The scale's reading is that of the body without the motor: motion
absorbs a mass that rides on the body exactly, so that only weighing it apart can tell it.
The search for left-out physics then starts from a model without either, and has to find both.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.model.effects import place
from rig_identification.model.motion import RigModel
from rig_identification.result import Finding, Identification
from rig_identification.search.identify import identify
from rig_identification.simulate import SampleRates, SessionSpec, case_spec, simulate_session
from rig_identification.thesis.case import Case

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

#: The motor's moving mass, kg, and how well the body without it was weighed, kg.
ROTOR, SCALE = 30.0, 0.2
#: Each run, the fitted and the held-out one, s. The gyroscopic term shows in the first swing.
DURATION = 8.0
RATES = SampleRates(tension=100.0, exciter=500.0, imu=100.0, inclinometer=50.0, ground_truth=0.0)


@dataclass(frozen=True)
class Examination:
    """What the search made of the session."""

    case: str
    rotor_mass: float  # kg, true
    duration: float  # s of each run
    true: Array  # (6,) kg m^2, about the body's centre of mass without the rotor: xx, xy, xz, yy, yz, zz
    before: Array  # (6,) by the thesis' model
    after: Array  # (6,) with what was found
    std: Array  # (6,) of ``after``
    holdout_before: float | None  # error of the held-out run, 1 is a perfect model
    holdout_after: float | None
    verdict: str
    explanation: str
    findings: tuple[Finding, ...]
    seconds: float  # of the search and its fits

    @property
    def scale(self) -> Array:
        """(6,) kg m^2 of which errors are percents: off the diagonal, the smallest diagonal element."""
        xx, _, _, yy, _, zz = self.true
        least = min(xx, yy, zz)
        return np.array([xx, least, least, yy, least, zz])

    def percent(self, inertia: Array) -> Array:
        """(6,) error of ``inertia`` (6,) kg m^2, in the order of ``true``."""
        return np.asarray(100.0 * (inertia - self.true) / self.scale)

    @property
    def statement(self) -> str:
        """One sentence for a person."""
        found = " and ".join(f.effect for f in self.findings) or "nothing"
        worst = [float(np.max(np.abs(self.percent(j)))) for j in (self.before, self.after)]
        return (
            f"Case {self.case} examined with the thesis' assumptions: {found} found; the largest error of "
            f"the inertia falls from {worst[0]:.2g} to {worst[1]:.2g} percent."
        )


def thesis_assumptions(model: RigModel) -> RigModel:
    """A rig's model without the gyroscopic moment, as the thesis writes it (its eq. 3.4 to 3.9)."""
    physics = model.physics.copy()
    physics[place.effects_block(model.cables) + place.GYROSCOPIC_SHARE] = 1.0
    return model.with_physics(physics)


def patient_spec(case: Case) -> SessionSpec:
    """The session: the case's own start and force, a held-out run pulled aside, bare and dummy at rest."""
    spec = case_spec(case, duration=DURATION, rates=RATES, doubts=False)
    return replace(spec, effects={"exciter_rotor": (ROTOR,)}, rig=replace(spec.rig, mass_std=SCALE))


def examine(case: Case, seed: int, progress: Progress | None = None) -> Examination:
    """Simulate the session and let the search loose on it with the thesis' model as the ideal one."""
    session, truth = simulate_session(patient_spec(case), np.random.default_rng(seed))
    begun = time.monotonic()
    answer = identify(session, progress, thesis_assumptions)
    ideal = answer.figures.get("ideal", answer)
    if not isinstance(ideal, Identification):
        raise AssertionError("the ideal model's answer is an identification")
    return Examination(
        case=case.label,
        rotor_mass=ROTOR,
        duration=DURATION,
        true=truth.elements[4:],
        before=ideal.total.values[4:],
        after=answer.total.values[4:],
        std=np.sqrt(np.diag(answer.total.covariance))[4:],
        holdout_before=ideal.holdout_error,
        holdout_after=answer.holdout_error,
        verdict=answer.mismatch.verdict,
        explanation=answer.mismatch.explanation,
        findings=answer.mismatch.findings,
        seconds=time.monotonic() - begun,
    )
