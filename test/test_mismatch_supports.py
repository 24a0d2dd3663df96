"""What gives way is found from far off; what recordings at rest and the scale say counts in a verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import fit_session, judged
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.estimate.stretching import usual_stiffness
from rig_identification.estimate.verdict import weighed_otherwise
from rig_identification.mismatch.amounts import supports
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import Promise, with_reference
from rig_identification.mismatch.supports import cable_elasticity
from rig_identification.mismatch.trial import VERY_FAR, attempt, mass_of
from rig_identification.recording import Series, Session
from rig_identification.simulate import simulate_session

#: N: the body bounces at some 30 Hz.
STIFFNESS = 2e7


@pytest.fixture(scope="module")
def inextensible() -> tuple[Problem, Evaluation]:
    """A session on cables that stretch, seen by a model of cables that do not; all else as it is."""
    spec = replace(shaken(14, 4.0), effects={"cable_elasticity": (STIFFNESS,)}, doubts=False)
    return seen_by_the_true_body(spec, 5)


def test_the_amount_of_stretch_is_promised_and_found(inextensible: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = inextensible
    promises = supports(problem, evaluation, mass_of(problem, evaluation))
    promise = next(p for p in promises if p.candidate.effect == "cable_elasticity")
    assert promise.values["cable.axial_stiffness"] == pytest.approx(STIFFNESS, rel=0.5)
    trial = attempt(problem, evaluation, promise)
    assert trial is not None
    assert misfit(trial.evaluation) < 1.1 < misfit(evaluation)
    found = trial.problem.bench.parameters.named(trial.evaluation.point.theta)
    assert found["cable.axial_stiffness"] == pytest.approx(STIFFNESS, rel=0.01)


def test_a_promise_too_far_off_is_walked_to(inextensible: tuple[Problem, Evaluation]) -> None:
    """A hinge a metre away throws out more than it explains: the fit starts from where it was."""
    problem, evaluation = inextensible
    hinge = next(c for c in catalogue(problem) if c.effect == "hinge_position")
    name = hinge.parameters[0].name
    place = hinge.parameters[0].nominal
    trial = attempt(problem, evaluation, Promise(hinge, 1e5, {name: place + 1.0}))
    assert trial is not None
    assert trial.evaluation.cost < evaluation.cost


def test_what_rings_is_given_up_where_the_first_second_shows_much_more_than_it_explains() -> None:
    """A cell that reads a fifth too much is off from the first sample on, whatever the cables' stiffness."""
    spec = shaken(14, 6.0)
    name = f"{spec.rig.cables[0].name}.load_cell_gain"
    session = simulate_session(replace(spec, effects={name: (0.2,)}), np.random.default_rng(8))[0]
    found = fit_session(session)
    problem, evaluation = with_reference(found.problem, found.rest), found.evaluation
    assert misfit(evaluation) > VERY_FAR
    soft = cable_elasticity(problem.bench.rig, problem.bench.parameters.model, mass_of(problem, evaluation))
    (name,) = (p.name for p in soft.parameters if p.name.endswith("axial_stiffness"))
    assert attempt(problem, evaluation, Promise(soft, 1e3, {name: STIFFNESS})) is None


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
