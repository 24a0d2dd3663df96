"""Rigs that more cables hold than it takes: whether they stretch is asked of rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig_identification.estimate.fitted import sure_of
from rig_identification.estimate.identify import fit_session, pose_problem
from rig_identification.estimate.stretching import STIFFNESS, where_they_stretch
from rig_identification.mismatch.stretched_at_first import with_stretch_told
from rig_identification.recording import Dummy
from rig_identification.result import ELEMENTS as ELEMENTS_BY_NAME
from rig_identification.result import Identification, Mismatch
from rig_identification.rig import Cable, Mount, Rig
from rig_identification.simulate import (
    Pulled,
    RunSpec,
    SampleRates,
    SessionSpec,
    StaticSpec,
    simulate_session,
)

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
#: EA of a soft rope, N.
SOFT = {"cable_elasticity": (1.5e6,)}
ELEMENTS = np.array([1500.0, 0.8, 1.4, -0.9, 1960.0, 12.0, -10.0, 600.0, -25.0, 2080.0])
NOISE = {
    "tension": 2.0,
    "exciter_force": 0.5,
    "specific_force": 0.01,
    "angular_rate": 3e-4,
    "inclination": 3e-4,
}


def hung(cables: int, effects: dict[str, tuple[float, ...]], runs: tuple[RunSpec, ...] = ()) -> SessionSpec:
    """A car on so many parallel cables of 2.8 m, two in a row; at rest alone and with a dummy."""
    points = np.array([[1.6 * (i % 2), 1.5 * (i // 2), 0.0] for i in range(cables)])
    rig = Rig(
        9.80665,
        tuple(Cable(f"cable_{i + 1}", p, p, 2.8) for i, p in enumerate(points)),
        mass=1500.0,
        mass_std=0.5,
        imu=Mount(np.array([0.8, 1.0, -0.2]), LEVEL),
        inclinometer=Mount(np.zeros(3), LEVEL),
        noise=NOISE,
    )
    statics = (
        StaticSpec("bare", 5.0),
        StaticSpec("with_dummy", 5.0, Dummy(50.0, np.array([0.3, 0.2, 0.1]))),
    )
    rates = SampleRates(tension=100.0, imu=100.0, inclinometer=50.0, ground_truth=0.0)
    return SessionSpec("hung", rig, ELEMENTS, runs=runs, statics=statics, rates=rates, effects=effects)


@pytest.mark.parametrize("seed", [1, 2])
def test_rest_tells_that_six_cables_stretch_and_about_how_far(seed: int) -> None:
    """By the tensions' shares, which lengths within half a millimetre make: to a part of EA."""
    session, _ = simulate_session(hung(6, SOFT), np.random.default_rng(seed))
    problem, theta, _ = pose_problem(session)
    found = where_they_stretch(problem, theta)
    assert found is not None
    assert found.gain is None or found.gain > 10.0
    EA = found.problem.bench.parameters.named(found.theta)[STIFFNESS]
    assert 1e6 < EA < 2.2e6


def test_three_cables_are_never_asked() -> None:
    below = np.array([*ELEMENTS[:1], 0.55, 0.5, *ELEMENTS[3:]])
    session, _ = simulate_session(replace(hung(3, SOFT), elements=below), np.random.default_rng(1))
    problem, theta, _ = pose_problem(session)
    assert where_they_stretch(problem, theta) is None


def test_four_that_do_not_stretch_stay_as_they_are() -> None:
    spec = replace(hung(4, {}), doubts=False)
    session, _ = simulate_session(spec, np.random.default_rng(3))
    problem, theta, _ = pose_problem(session)
    assert where_they_stretch(problem, theta) is None


def test_a_run_on_six_cables_is_fitted_and_the_stretch_is_told_first() -> None:
    """Within 3.5 std: of ten numbers one lies farther once in two hundred sessions.

    The covariance at the end of this fit alone has Jxx and Jyy known to a part of a believed std, eight of
    their own stds off the truth.
    """
    run = RunSpec("run_1", 4.0, Pulled(np.array([400.0, 500.0, 0.0]), np.array([1.6, 0.0, -0.5])))
    session, _ = simulate_session(hung(6, SOFT, (run,)), np.random.default_rng(5))
    fitted = fit_session(session)
    parameters = fitted.problem.bench.parameters
    theta = fitted.evaluation.point.theta
    assert fitted.converged
    covariance = np.linalg.inv(fitted.evaluation.information)
    stiff = parameters.index_of(STIFFNESS)
    away = np.log(parameters.named(theta)[STIFFNESS] / 1.5e6)
    assert abs(away) < 3.5 * np.sqrt(covariance[stiff, stiff])
    valley = sure_of(fitted)
    assert valley is not None
    assert valley.followed
    assert valley.note is not None
    total = valley.estimate
    # In four seconds, not shaken, it hardly turns: of its inertia next to nothing is known
    assert {"m", "cx", "cy"}.isdisjoint(total.unobservable)
    known = np.array([name not in total.unobservable for name in ELEMENTS_BY_NAME])
    off = np.abs(total.values - ELEMENTS) / np.sqrt(np.diag(total.covariance))
    assert np.max(off[known]) < 3.5
    plain = Identification(total, None, Mismatch("none", "Every residual is noise."), (), (), None, 1.0, True)
    told = with_stretch_told(plain, fitted)
    assert told.mismatch.verdict == "explained"
    assert [f.effect for f in told.mismatch.findings] == ["cable_elasticity"]
