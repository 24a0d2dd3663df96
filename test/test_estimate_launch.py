"""From nothing to a first guess on a rig that hangs otherwise than described."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import fit_session, pose_problem
from rig_identification.estimate.launch import Launch
from rig_identification.recording import Dummy, Session
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.simulate import (
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    StaticSpec,
    UnbalancedMass,
    simulate_session,
)
from rig_identification.simulate.thesis_case import NOISE

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
ELEMENTS = np.array([1090.0, 1.05, 1.0, -0.98, 1500.0, -12.0, 2.0, 465.0, 15.0, 1565.0])


def tilted_trifilar() -> Session:
    """Parallel cables: one hinge that sits 5 mm lower than described tilts the body by 2 mrad."""
    hinges = np.array([[0.0, 0.0, 0.0], [2.0, 0.07, 0.0], [0.9, 2.99, 0.0]])
    cables = tuple(Cable(f"cable_{i + 1}", hinges[i], hinges[i], 3.45, "ceiling") for i in range(3))
    rig = Rig(
        gravity=9.80665,
        cables=cables,
        mass=1090.0,
        mass_std=0.5,
        imu=Mount(np.array([0.8, 1.4, -0.5]), LEVEL),
        inclinometer=Mount(np.zeros(3), LEVEL),
        exciter=Mount(np.array([0.1, 0.2, -1.1]), LEVEL),
        noise=dict(NOISE),
    )
    motor = UnbalancedMass(4.0, 0.92, "xy", ramp=3.0)
    pull = Pulled(np.array([400.0, -200.0, 0.0]), ELEMENTS[1:4] + np.array([0.3, 0.2, 0.0]))
    spec = SessionSpec(
        "tilted",
        rig,
        ELEMENTS,
        statics=(
            StaticSpec("static_bare", 4.0),
            StaticSpec("static_dummy", 4.0, Dummy(44.0, np.array([0.6, 0.9, 0.0]))),
        ),
        runs=(RunSpec("run_1", 12.0, pull, motor),),
        rates=SampleRates(
            tension=200.0, exciter=200.0, shaft=0.0, imu=100.0, inclinometer=50.0, ground_truth=0.0
        ),
        doubts=False,
    )
    session, _ = simulate_session(spec, np.random.default_rng(3))
    higher = replace(cables[2], ceiling_point=cables[2].ceiling_point + np.array([0.0, 0.0, 0.005]))
    return replace(session, rig=replace(session.rig, cables=(*cables[:2], higher)))


def test_a_tilt_is_not_taken_for_a_body_that_starts_elsewhere() -> None:
    """Ten tolerances of one hinge: a tilt of six samples' noise, and nothing else that is wrong."""
    session = tilted_trifilar()
    problem, theta, _ = pose_problem(session)
    launch = Launch(problem, theta).from_rest().from_momentum()
    guess = problem.bench.parameters.elements(launch.theta)
    assert abs(guess[0] - ELEMENTS[0]) < 0.05 * ELEMENTS[0]
    assert np.max(np.abs(guess[1:4] - ELEMENTS[1:4])) < 0.1
    fitted = fit_session(session)
    assert fitted.converged
    assert misfit(fitted.evaluation) < 1.1
