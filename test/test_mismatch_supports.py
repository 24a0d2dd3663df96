"""What gives way is found from far off; what recordings at rest and the scale say counts in a verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import fit_session, judged
from rig_identification.estimate.solve import Evaluation, Problem, evaluate
from rig_identification.estimate.stretching import usual_stiffness
from rig_identification.estimate.verdict import weighed_otherwise
from rig_identification.mismatch.amounts import SPACED, Amount, ringing_like, supports
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.first_fits import begun
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.riders import Swing, rider_candidate
from rig_identification.mismatch.screen import Promise, carried, extended
from rig_identification.mismatch.supports import cable_elasticity
from rig_identification.mismatch.trial import Trial, attempt, mass_of, promised
from rig_identification.recording import Series, Session
from rig_identification.simulate import simulate_session

#: N: the body bounces at some 30 Hz.
STIFFNESS = 2e7


@pytest.fixture(scope="module")
def inextensible() -> tuple[Problem, Evaluation]:
    """A session on cables that stretch, seen by a model of cables that do not; all else as it is."""
    spec = replace(shaken(14, 4.0), effects={"cable_elasticity": (STIFFNESS,)}, doubts=False)
    return seen_by_the_true_body(spec, 5)


@pytest.mark.parametrize("start", [0.25, 4.0])
def test_the_amount_of_stretch_is_found_from_far_off(
    inextensible: tuple[Problem, Evaluation], start: float
) -> None:
    problem, evaluation = inextensible
    mass = mass_of(problem, evaluation)
    elasticity = cable_elasticity(problem.bench.rig, problem.bench.parameters.model, mass)
    amount = Amount(problem, evaluation, elasticity, "cable.axial_stiffness")
    promise = amount.refined(amount.best([start * STIFFNESS, 1.8 * STIFFNESS]), SPACED)
    assert promise.values["cable.axial_stiffness"] == pytest.approx(STIFFNESS, rel=0.3)
    trial = attempt(problem, evaluation, promise)
    assert trial is not None
    assert misfit(trial.evaluation) < 1.1 < misfit(evaluation)
    parameters = trial.problem.bench.parameters
    found = parameters.named(trial.evaluation.point.theta)
    assert found["cable.axial_stiffness"] == pytest.approx(STIFFNESS, rel=0.01)


def test_a_spent_budget_begins_nothing_that_changes_the_model(
    inextensible: tuple[Problem, Evaluation],
) -> None:
    problem, evaluation = inextensible
    mass = mass_of(problem, evaluation)
    stretch = cable_elasticity(problem.bench.rig, problem.bench.parameters.model, mass)
    gain = next(c for c in catalogue(problem) if c.effect == "load_cell_gain")
    promises = [
        Promise(stretch, 1e6, {"cable.axial_stiffness": STIFFNESS}, 1.0),
        Promise(gain, 1e5, {}, 0.1),
    ]
    tried = begun(problem, evaluation, promises, True, lambda stage: None, Budget(0.0))
    assert [t.candidate.effect for t in tried] == ["load_cell_gain"]
    assert supports(problem, evaluation, mass, Budget(0.0)) == []


def test_a_promise_too_far_off_is_walked_to(inextensible: tuple[Problem, Evaluation]) -> None:
    """A hinge a metre away throws out more than it explains: the fit starts from where it was."""
    problem, evaluation = inextensible
    hinge = next(c for c in catalogue(problem) if c.effect == "hinge_position")
    name = hinge.parameters[0].name
    place = hinge.parameters[0].nominal
    trial = attempt(problem, evaluation, Promise(hinge, 1e5, {name: place + 1.0}, 0.5))
    assert trial is not None
    assert trial.evaluation.cost < evaluation.cost


def test_a_ceiling_is_begun_as_fast_as_the_part_on_springs_that_stands_in_for_it(
    inextensible: tuple[Problem, Evaluation],
) -> None:
    problem, evaluation = inextensible
    mass = mass_of(problem, evaluation)
    springs, values = rider_candidate(problem, Swing("y", 6.5), mass, 10.0, np.zeros(3))
    wide = extended(problem, (springs,))
    begun_there = carried(wide, problem, evaluation.point)
    at = evaluate(wide, promised(wide, begun_there, springs, values, evaluation))
    assert at is not None
    much = replace(evaluation, runs=tuple(replace(r, residual=10.0 * r.residual) for r in at.runs))
    trial = Trial(springs, wide, at, 0.0)
    (promise,) = ringing_like(problem, [trial], much, mass)
    assert promise.candidate.where == {"channel": "ceiling", "axis": "y"}
    nominal = {p.name: p.nominal for p in promise.candidate.parameters}
    assert nominal["ceiling.frequency.y"] == pytest.approx(6.5)
    assert promise.values["ceiling.compliance.y"] > 0.0
    # What leaves as much as there was stands in for nothing
    assert ringing_like(problem, [trial], at, mass) == []
    assert ringing_like(problem, [], much, mass) == []


def test_the_usual_stiffness_is_within_what_wire_and_rope_have() -> None:
    """A car on steel cables 4 to 16 mm thick: EA from 1e6 to 2e7 N."""
    rig = shaken(14).rig
    assert 1e6 < usual_stiffness(rig, 1000.0) < 2e7


@pytest.fixture(scope="module")
def session() -> Session:
    return simulate_session(shaken(14), np.random.default_rng(23))[0]


@pytest.fixture(scope="module")
def fitted(session: Session) -> Fitted:
    return fit_session(session)


def test_a_clean_session_is_judged_clean(fitted: Fitted) -> None:
    assert judged(fitted)[1].verdict == "none"
    assert weighed_otherwise(fitted) is None


def test_a_level_that_moved_between_two_recordings_at_rest_is_seen(session: Session) -> None:
    """20 mrad in one recording alone: no zero of the instrument explains it."""
    first = session.statics[0]
    assert first.inclination is not None
    moved = Series(first.inclination.time, first.inclination.values + np.array([0.02, 0.0]))
    statics = {first.name: replace(first, inclination=moved)}
    recordings = tuple(statics.get(r.name, r) for r in session.recordings)
    mismatch = judged(fit_session(replace(session, recordings=recordings)))[1]
    assert mismatch.verdict == "unexplained"
    assert "at rest in" in mismatch.explanation.lower()


def test_what_the_scale_contradicts_is_said(fitted: Fitted) -> None:
    mass = float(fitted.problem.bench.parameters.elements(fitted.evaluation.point.theta)[0])
    heavier = replace(fitted, problem=replace(fitted.problem, mass=(mass + 30.0, 0.5)))
    assert "the scale says" in (weighed_otherwise(heavier) or "")
    assert judged(heavier)[1].verdict == "unexplained"


def test_a_held_out_run_that_cannot_be_followed_refutes(fitted: Fitted) -> None:
    mismatch = judged(replace(fitted, lost=(fitted.problem.runs[0],)))[1]
    assert mismatch.verdict == "unexplained"
    assert "run_1, held out, cannot be followed" in mismatch.explanation.lower()
