"""A fit that fitted runs take for noise and held-out ones do not is begun anew along what happened."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import evaluate
from rig_identification.mismatch.whole_runs import _along_what_happened, strayed
from rig_identification.simulate import simulate_session
from rig_identification.simulate.exciter import UnbalancedMass
from rig_identification.simulate.start import Pulled


@pytest.fixture(scope="module")
def clean() -> Fitted:
    """Shaken at one frequency; held out, pulled aside and let go."""
    spec = shaken(10, 12.0)
    weight, at = float(spec.elements[0]) * spec.rig.gravity, spec.elements[1:4]
    motor = UnbalancedMass(0.03 * weight / (2.0 * np.pi * 1.1) ** 2, 1.1, ramp=2.0)
    pull = Pulled(0.1 * weight * np.array([0.1, 1.0, 0.0]), at + np.array([0.6, 0.1, 0.0]))
    free = replace(spec.runs[0], name="run_2", holdout=True, start=pull, force=None)
    spec = replace(spec, runs=(replace(spec.runs[0], force=motor), free))
    return fit_session(simulate_session(spec, np.random.default_rng(2))[0])


def elements(fitted: Fitted) -> np.ndarray:
    return np.asarray(fitted.problem.bench.parameters.elements(fitted.evaluation.point.theta))


def never() -> bool:
    return False


def larger(fitted: Fitted, by: float) -> np.ndarray:
    """The fit's numbers with moments of inertia so many times as large."""
    body, theta = elements(fitted).copy(), fitted.evaluation.point.theta.copy()
    body[[4, 7, 9]] *= by
    theta[:INERTIAL] = fitted.problem.bench.parameters.start(body)[:INERTIAL]
    return theta


def test_what_only_held_out_runs_contradict_has_strayed(clean: Fitted) -> None:
    """Residuals as of the right numbers, which held-out runs are predicted without."""
    assert not strayed(clean)
    point = replace(clean.evaluation.point, theta=larger(clean, 1.05))
    assert strayed(replace(clean, evaluation=replace(clean.evaluation, point=point)))


def test_what_fitted_runs_contradict_has_not(clean: Fitted) -> None:
    runs = tuple(replace(run, residual=2.0 * run.residual) for run in clean.evaluation.runs)
    assert not strayed(replace(clean, evaluation=replace(clean.evaluation, runs=runs)))


def test_a_body_far_off_comes_back(clean: Fitted) -> None:
    """From moments of inertia a fifth too large."""
    problem, point = clean.problem, clean.evaluation.point
    theta = larger(clean, 1.2)
    there = evaluate(problem, replace(point, theta=theta))
    assert there is not None
    back = _along_what_happened(clean, replace(clean, evaluation=there), never)
    assert back.evaluation.cost == pytest.approx(clean.evaluation.cost, abs=0.5)
    np.testing.assert_allclose(elements(back)[[4, 7, 9]], elements(clean)[[4, 7, 9]], rtol=1e-3)


def test_where_nothing_better_is_near_a_fit_stays(clean: Fitted) -> None:
    again = _along_what_happened(clean, clean, never)
    assert again.evaluation.cost <= clean.evaluation.cost
    assert clean.evaluation.cost - again.evaluation.cost < 0.1
