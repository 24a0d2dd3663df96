"""Each of several findings bears its own evidence: what is lost when it alone is taken out of the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.identify import Ideal, Scores, fit_session, judged
from rig_identification.estimate.solve import evaluate, solve
from rig_identification.mismatch import whole_runs
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.by_itself import each_by_itself, not_weighed
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.explained import Explained
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import carried, extended, with_reference
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import Trial, is_ordinary, mass_of, may_be_none, ordinary_amount
from rig_identification.mismatch.whole_runs import Named, as_fitted, fitted_whole, ordinary_alone, pruned
from rig_identification.recording import Recording
from rig_identification.result import Mismatch
from rig_identification.simulate import simulate_session

#: Turn of the inclinometer about y, rad, and what every hinge resists, N m s/rad.
TURNED, DAMPING = 0.01, 40.0


def _turned(recording: Recording) -> Recording:
    inclination = recording.inclination
    assert inclination is not None
    return replace(
        recording, inclination=replace(inclination, values=inclination.values + np.array([0.0, TURNED]))
    )


@pytest.fixture(scope="module")
def ideal() -> Ideal:
    spec = shaken(10)
    (run,) = spec.runs
    held = replace(run, name="run_2", holdout=True)
    spec = replace(spec, runs=(run, held), effects={"hinge_damping": (DAMPING,)}, doubts=False)
    session, _ = simulate_session(spec, np.random.default_rng(5))
    fitted = fit_session(replace(session, recordings=tuple(_turned(r) for r in session.recordings)))
    return Ideal(fitted, *judged(fitted))


def _with(ideal: Ideal, labels: list[str]) -> tuple[Explained, Named]:
    """Whole runs with some effects of the catalogue."""
    fitted = ideal.fitted
    problem = with_reference(fitted.problem, fitted.rest)
    known = {c.label: c for c in catalogue(problem)}
    chosen: list[Candidate] = [known[label] for label in labels]
    here = extended(problem, tuple(chosen))
    point = carried(here, problem, fitted.evaluation.point)
    found = tuple(Trial(c, here, fitted.evaluation, 0.0) for c in chosen)
    named = Named(problem, found, UNLIMITED)
    return fitted_whole(ideal, named, list(found), here, point), named


@pytest.fixture(scope="module")
def both(ideal: Ideal) -> Explained:
    return _with(ideal, ["inclinometer_offset inclinometer y", "hinge_damping"])[0]


def never() -> bool:
    return False


def test_each_is_worth_what_a_model_without_it_lacks(ideal: Ideal, both: Explained) -> None:
    assert both.wholly
    together = float(ideal.fitted.evaluation.cost - both.fitted.evaluation.cost)
    findings = each_by_itself(both, never).mismatch.findings
    assert {f.effect for f in findings} == {"inclinometer_offset", "hinge_damping"}
    for trial in both.effects:
        (told,) = (f for f in findings if f.effect == trial.candidate.effect)
        gain, before = told.evidence["log_likelihood_gain"], told.evidence["holdout_error_before"]
        (other,) = (t.candidate for t in both.effects if t is not trial)
        less = extended(with_reference(ideal.fitted.problem, ideal.fitted.rest), (other,))
        point = carried(less, both.fitted.problem, both.fitted.evaluation.point)
        ended, converged = solve(less, point, iterations=40)
        assert converged
        true = ended.cost - both.fitted.evaluation.cost
        assert gain is not None
        assert true - 0.5 < gain < 1.05 * true + 1.0
        assert gain < together
        after = told.evidence["holdout_error_after"]
        assert before is not None
        assert after is not None
        assert after < before


def test_the_two_differ(both: Explained) -> None:
    gains = [f.evidence["log_likelihood_gain"] for f in each_by_itself(both, never).mismatch.findings]
    assert gains[0] != gains[1]


def test_one_alone_is_worth_what_it_gains_over_the_ideal_model(ideal: Ideal) -> None:
    alone, _ = _with(ideal, ["hinge_damping"])
    (told,) = each_by_itself(alone, never).mismatch.findings
    gain = ideal.fitted.evaluation.cost - alone.fitted.evaluation.cost
    assert told.evidence["log_likelihood_gain"] == pytest.approx(gain)


def test_what_may_as_well_be_none_is_no_finding(ideal: Ideal) -> None:
    labels = ["inclinometer_offset inclinometer y", "hinge_damping", "hinge_friction"]
    three, named = _with(ideal, labels)
    rubbing = next(t for t in three.effects if t.candidate.effect == "hinge_friction")
    assert may_be_none(as_fitted(three.fitted, rubbing))
    told = {"inclinometer_offset", "hinge_damping"}
    assert {f.effect for f in three.mismatch.findings} == told | {"hinge_friction"}
    assert {f.effect for f in each_by_itself(three, never).mismatch.findings} == told
    assert {f.effect for f in pruned(three, named, 100).mismatch.findings} == told


def test_without_time_no_gain_is_told(both: Explained) -> None:
    for found in (not_weighed(both), each_by_itself(both, lambda: True)):
        assert len(found.mismatch.findings) == 2
        for told in found.mismatch.findings:
            assert told.evidence["log_likelihood_gain"] is None
            assert told.evidence["holdout_error_after"] is not None


def test_what_explains_a_part_has_an_amount(ideal: Ideal, monkeypatch: pytest.MonkeyPatch) -> None:
    def unlike_noise(fitted: Fitted) -> tuple[Scores, Mismatch]:
        after, verdict = judged(fitted)
        return after, replace(verdict, verdict="unexplained")

    # What is left shows in none of the numbers
    monkeypatch.setattr(whole_runs, "judged", unlike_noise)
    monkeypatch.setattr(whole_runs, "trace_of", lambda *_: None)
    part, _ = _with(ideal, ["inclinometer_offset inclinometer y", "hinge_damping", "hinge_friction"])
    assert part.mismatch.verdict == "unexplained"
    assert {f.effect for f in part.mismatch.findings} == {"inclinometer_offset", "hinge_damping"}
    assert "hinge_friction" not in part.mismatch.explanation


def test_what_is_ordinary_is_in_the_model_and_no_finding(ideal: Ideal) -> None:
    """Every device follows a little late; the ideal model does not ask how late."""
    three, _ = _with(ideal, ["inclinometer_offset inclinometer y", "hinge_damping", "sensor_lag"])
    lag = as_fitted(three.fitted, next(t for t in three.effects if t.candidate.effect == "sensor_lag"))
    (own,) = lag.candidate.parameters
    assert abs(lag.values[own.name]) < 1e-3
    assert is_ordinary(lag)
    assert {f.effect for f in three.mismatch.findings} == {"inclinometer_offset", "hinge_damping"}
    parameters, point = lag.problem.bench.parameters, lag.evaluation.point
    theta = point.theta.copy()
    theta[parameters.index_of(own.name)] = 0.02 / own.prior_std
    late = replace(lag, evaluation=replace(lag.evaluation, point=replace(point, theta=theta)))
    assert not is_ordinary(late)
    assert ordinary_amount(lag.candidate, {own.name: 1e-3})
    assert not ordinary_amount(lag.candidate, {own.name: 0.02})
    assert not ordinary_amount(three.effects[0].candidate, {})
    # What the ideal model doubts itself is judged by its tolerance
    others = (t for t in three.effects if t.candidate.effect != "sensor_lag")
    assert not any(is_ordinary(as_fitted(three.fitted, t)) for t in others)


def test_a_thousandth_of_the_body_is_on_every_rig(ideal: Ideal) -> None:
    problem = ideal.fitted.problem
    mass = mass_of(problem, ideal.fitted.evaluation)
    weighed = [c for c in catalogue(problem) if c.positive and c.parameters[0].unit == "kg"]
    problem = with_reference(problem, ideal.fitted.rest)
    evaluation = evaluate(problem, ideal.fitted.evaluation.point)
    assert evaluation is not None
    asked = (p.candidate for p in screen(problem, evaluation, catalogue(problem), mass))
    weighed += [c for c in asked if c.effect in ("sprung_mass", "liquid_slosh")]
    assert {c.effect for c in weighed} > {"air_added_mass"}
    for candidate in weighed:
        name = candidate.parameters[0].name
        assert ordinary_amount(candidate, {name: 0.0009 * mass})
        assert not ordinary_amount(candidate, {name: 0.0012 * mass})


def test_nothing_but_what_is_ordinary_is_no_finding(both: Explained) -> None:
    assert ordinary_alone(both) is both
    alone = replace(both, mismatch=replace(both.mismatch, findings=()))
    told = ordinary_alone(alone).mismatch
    assert told.verdict == "none"
    assert "no finding" in told.explanation
    assert ordinary_alone(replace(alone, trace=True)).mismatch.verdict == "explained"
