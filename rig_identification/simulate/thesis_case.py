"""The case studies of chapter 4 as sessions: their rig, body, start and force under this rig's sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.model.body import six_elements
from rig_identification.recording import Dummy
from rig_identification.rig import Rig
from rig_identification.simulate.spec import RunSpec, SampleRates, SessionSpec, StaticSpec
from rig_identification.simulate.start import Posed, Pulled
from rig_identification.thesis.case import Case

#: Noise of good industrial sensors: load cells of a tonne, a tactical IMU.
NOISE = {
    "tension": 2.0,
    "exciter_force": 0.5,
    "specific_force": 0.01,
    "angular_rate": 0.0003,
    "inclination": 0.0003,
    "mocap_position": 0.0003,
    "mocap_orientation": 0.001,
}
#: The dummy's mass and the held-out run's pull, as shares of the body's mass and weight.
DUMMY, PULL = 0.04, 0.05


def case_spec(
    case: Case,
    *,
    duration: float = 20.0,
    rest: float = 10.0,
    holdout: bool = True,
    rates: SampleRates | None = None,
    noise: bool = True,
    doubts: bool = True,
    rods: bool = False,
) -> SessionSpec:
    """A session of one case: bare and dummy at rest (``rest`` s), a run as in the thesis, one held out.

    The held-out run starts pulled aside by a twentieth of the weight, under the same force.
    """
    elements = np.concatenate([[case.mass], case.center_of_mass, six_elements(case.inertia)])
    rig = replace(case.rig, mass=case.mass, mass_std=0.0005 * case.mass, noise=dict(NOISE))
    force = case.force if case.force.segments else None
    runs = [RunSpec("run_1", duration, Posed(case.position, case.orientation), force)]
    if holdout:
        pull = PULL * case.mass * rig.gravity * np.array([0.6, 0.8, 0.0])
        runs.append(RunSpec("run_2", duration, Pulled(pull, case.center_of_mass), force, holdout=True))
    return SessionSpec(
        name=f"case_{case.label}",
        rig=rig,
        elements=elements,
        runs=tuple(runs),
        statics=resting(rig, case.mass, rest),
        rates=rates or SampleRates(),
        noise=noise,
        doubts=doubts,
        rods=rods,
    )


def resting(rig: Rig, mass: float, seconds: float) -> tuple[StaticSpec, ...]:
    """Bare, and with a dummy of a 25th of ``mass`` between the hinges; none for 0 s."""
    if seconds <= 0.0:
        return ()
    hinges = np.array([cable.body_point for cable in rig.cables])
    place = np.round(hinges.min(axis=0) + 0.3 * np.ptp(hinges, axis=0), 3)
    dummy = Dummy(float(f"{DUMMY * mass:.2g}"), place)
    return (StaticSpec("static_bare", seconds), StaticSpec("static_dummy", seconds, dummy))
