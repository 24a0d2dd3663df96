"""Soft cables stand out along the motion that was measured, and nothing else looks like them."""

from __future__ import annotations

from dataclasses import replace

import pytest
from test_mismatch_along_measured import _off
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.stretching import usual_stiffness
from rig_identification.mismatch.screen import with_reference
from rig_identification.mismatch.stretched import ENOUGH, STIFFNESSES, stretched_along
from rig_identification.mismatch.trial import VERY_FAR, attempt, mass_of


def _soft(stiffness: float) -> tuple[Problem, Evaluation]:
    """A session on cables of so much EA (N), seen by a model of cables that do not stretch."""
    effects = {"cable_elasticity": (stiffness,), "cable_damping_ratio": (0.02,)}
    return seen_by_the_true_body(replace(shaken(10, 4.0), effects=effects, doubts=False), 5)


@pytest.mark.parametrize("softness", [0.06, 0.25])
def test_soft_cables_are_told_from_far_off(softness: float) -> None:
    problem, evaluation = _soft(1e7)
    mass = mass_of(problem, evaluation)
    stiffness = softness * usual_stiffness(problem.bench.rig, mass)
    problem, evaluation = _soft(stiffness)
    assert misfit(evaluation) > VERY_FAR
    promise = stretched_along(problem, evaluation, mass)
    assert promise is not None
    assert promise.share > ENOUGH
    told = promise.values["cable.axial_stiffness"] / stiffness
    # One of its neighbours at least
    assert max(told, 1.0 / told) < STIFFNESSES[1] / STIFFNESSES[0]
    trial = attempt(problem, evaluation, promise, growing=True)
    assert trial is not None
    assert misfit(trial.evaluation) < 1.1
    found = trial.problem.bench.parameters.named(trial.evaluation.point.theta)
    assert found["cable.axial_stiffness"] == pytest.approx(stiffness, rel=0.01)
    # With them in the model there is nothing to ask any more
    assert stretched_along(trial.problem, trial.evaluation, mass) is None


def test_a_gyroscope_that_is_off_does_not_look_like_soft_cables() -> None:
    fitted = fit_session(_off(0.05, {}), lambda stage, share: None)
    assert fitted.guess is not None
    problem = with_reference(fitted.problem, fitted.rest)
    mass = mass_of(problem, fitted.evaluation)
    assert stretched_along(problem, fitted.evaluation, mass, fitted.guess.theta) is None
