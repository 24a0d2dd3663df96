"""The thesis' assumptions as the ideal model of a session in full physics: what was left out is found."""

from dataclasses import replace

import numpy as np
import pytest

from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.launch import Launch
from rig_identification.estimate.solve import evaluate
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import carried, extended
from rig_identification.result import Finding
from rig_identification.simulate import simulate_session
from rig_identification.thesis import load_case
from rig_identification.thesis_report import Figures, rerun_document, write_page
from rig_identification.thesis_rerun import Examination, Rerun
from rig_identification.thesis_rerun.patient import ROTOR, examine, patient_spec, thesis_assumptions


@pytest.fixture(scope="module")
def session():
    spec = patient_spec(load_case(14))
    short = replace(spec, runs=tuple(replace(run, duration=3.0) for run in spec.runs))
    return simulate_session(short, np.random.default_rng(0))[0]


def test_scale_and_load_cells_differ_by_the_motor(session):
    resting = session.statics[0]
    weight = sum(float(np.mean(series.values)) for series in resting.tension.values())
    case = load_case(14)
    assert session.rig.mass == case.mass
    # Splayed cables pull more than the weight alone
    assert weight > (case.mass + ROTOR) * case.rig.gravity


@pytest.mark.parametrize(("assumed", "offered"), [(None, False), (thesis_assumptions, True)])
def test_the_term_is_a_hypothesis_only_where_the_ideal_model_lacks_it(session, assumed, offered):
    problem, _, _ = pose_problem(session, assumed)
    effects = [candidate.effect for candidate in catalogue(problem)]
    assert ("gyroscopic_term" in effects) is offered
    assert "exciter_rotor" in effects


def test_a_body_less_its_rotor_moves_as_the_body_that_held_it(session):
    """Motion absorbs a mass that rides on the body exactly: residuals of the runs must not change."""
    problem, theta, _ = pose_problem(session)
    point = Launch(problem, theta).from_rest().from_momentum().point()
    before = evaluate(problem, point)
    candidate = next(c for c in catalogue(problem) if c.effect == "exciter_rotor")
    wide = extended(problem, (candidate,))
    with_rotor = carried(wide, problem, point)
    rotor = wide.bench.parameters.index_of("exciter.rotor_mass")
    with_rotor.theta[rotor] = candidate.parameters[0].position(25.0)
    settled = candidate.settle(wide, with_rotor, before)
    after = evaluate(wide, settled)
    lighter = wide.bench.parameters.elements(settled.theta)[0]
    assert lighter == pytest.approx(problem.bench.parameters.elements(point.theta)[0] - 25.0)
    for one, other in zip(before.runs, after.runs, strict=True):
        np.testing.assert_allclose(other.residual, one.residual, rtol=1e-5, atol=1e-5)
    unsettled = evaluate(wide, with_rotor)
    assert np.max(np.abs(unsettled.runs[0].residual - before.runs[0].residual)) > 10.0


@pytest.mark.long
def test_what_the_thesis_left_out_is_found_and_the_inertia_comes_back():
    found = examine(load_case(14), 1)
    assert found.verdict == "explained"
    told = {f.effect: next(iter(f.parameters.values())) for f in found.findings}
    assert set(told) == {"gyroscopic_term", "exciter_rotor"}
    for effect, true in (("gyroscopic_term", 1.0), ("exciter_rotor", ROTOR)):
        assert abs(told[effect]["value"] - true) < 3.0 * told[effect]["std"]
        assert told[effect]["std"] < 0.03 * true
    assert np.max(np.abs(found.percent(found.before))) > 3.0
    assert np.max(np.abs(found.percent(found.after))) < 0.3
    assert np.all(np.abs(found.after - found.true) < 3.5 * found.std)
    assert found.holdout_before > 3.0
    assert found.holdout_after < 1.1


def rendered(found, folder):
    write_page(found, Figures({}, {}), 1.0, folder / "report.html")
    return (folder / "report.html").read_text()


def test_page_and_document_hold_the_examination(tmp_path):
    true = np.array([1617.0, 0.0, 0.0, 365.0, 70.0, 1785.0])
    finding = Finding("gyroscopic_term", {}, {}, {}, "All of the moment acts.")
    found = Examination(
        case="14",
        rotor_mass=30.0,
        duration=8.0,
        true=true,
        before=true + np.array([16.17, 0.0, 36.5, 0.0, 0.0, 0.0]),
        after=true,
        std=0.001 * np.ones(6),
        holdout_before=11.5,
        holdout_after=0.99,
        verdict="explained",
        explanation="Every residual is noise.",
        findings=(finding,),
        seconds=1.0,
    )
    assert found.percent(found.before) == pytest.approx([1.0, 0.0, 10.0, 0.0, 0.0, 0.0])
    document = rerun_document(Rerun((), None, None, found), 1.0)["examination"]
    assert document["findings"][0]["effect"] == "gyroscopic_term"
    assert document["percent_before"][2] == pytest.approx(10.0)
    page = rendered(Rerun((), None, None, found), tmp_path)
    assert 'id="patient"' in page
    assert "All of the moment acts." in page
    assert "11.50" in page
    assert 'id="patient"' not in rendered(Rerun((), None, None), tmp_path)
