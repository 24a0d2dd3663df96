"""What the recordings neither show nor exclude is stated, and the body's interval covers it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.solve import evaluate
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.opened import carried, extended, with_reference
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import log_evidence, mass_of
from rig_identification.mismatch.undecided import shared_by_places
from rig_identification.result import Identification
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

#: kg of entrained air that gains less than chance may, and more than its prior is charged.
AIR = 11.0


def answer(effects: dict[str, tuple[float, ...]], seed: int) -> tuple[Identification, np.ndarray]:
    """The answer to a session with ``effects``, and its deviation from the body in the answer's own std."""
    spec = replace(shaken(10, 10.0), effects=effects, doubts=False)
    session, truth = simulate_session(spec, np.random.default_rng(seed))
    found = identify(session)
    return found, (found.total.values - truth.elements) / np.sqrt(np.diag(found.total.covariance))


@pytest.fixture(scope="module")
def with_air() -> tuple[Identification, np.ndarray]:
    return answer({"air_added_mass": (AIR,)}, 2)


def test_air_that_gains_less_than_chance_is_stated_and_not_told(
    with_air: tuple[Identification, np.ndarray],
) -> None:
    mismatch = with_air[0].mismatch
    assert mismatch.verdict == "none"
    assert not mismatch.findings
    assert mismatch.alternatives[0]["effect"] == "air_added_mass"
    assert 0.0 <= float(str(mismatch.alternatives[0]["log_likelihood_gap"])) < 3.0
    assert "air_added_mass" in mismatch.explanation
    assert mismatch.alternatives[0]["experiment"]


@pytest.fixture(scope="module")
def clean() -> tuple[Identification, np.ndarray]:
    return answer({}, 2)


def test_the_interval_covers_the_body_with_and_without(
    with_air: tuple[Identification, np.ndarray], clean: tuple[Identification, np.ndarray]
) -> None:
    """It is wider than where there is nothing to doubt, for the same rig and motion."""
    (found, deviation), (without, _) = with_air, clean
    assert np.max(np.abs(deviation)) < 3.0
    wider = np.sqrt(np.diag(found.total.covariance) / np.diag(without.total.covariance))
    assert np.max(wider) > 1.1


@pytest.fixture(scope="module")
def with_light_cables() -> tuple[Identification, np.ndarray]:
    """Cables of 0.15 kg/m, which the tolerances of lengths and hinges account for."""
    return answer({"cable_mass": (0.15,)}, 2)


def test_cables_that_tolerances_account_for_are_in_the_interval(
    with_light_cables: tuple[Identification, np.ndarray],
) -> None:
    found, deviation = with_light_cables
    assert found.mismatch.verdict == "none"
    assert "cable_mass" in {a["effect"] for a in found.mismatch.alternatives}
    assert np.max(np.abs(deviation)) < 3.5


def test_a_clean_session_states_only_what_every_rig_has(clean: tuple[Identification, np.ndarray]) -> None:
    found, deviation = clean
    assert found.mismatch.verdict == "none"
    assert not found.mismatch.findings
    for stated in found.mismatch.alternatives:
        where = stated["where"]
        assert isinstance(where, dict)
        assert where.get("law", stated["effect"]) in ("cable_mass", "air_added_mass", "torsion of the cables")
    assert np.max(np.abs(deviation)) < 3.5


def test_what_a_freed_doubt_is_charged_is_what_evidence_takes_for_it() -> None:
    """Laplace's charge for a tolerance let go: by how much less sharp the fit's information is without it."""
    spec = replace(shaken(10, 10.0), doubts=False)
    fitted = fit_session(simulate_session(spec, np.random.default_rng(2))[0])
    problem, evaluation = with_reference(fitted.problem, fitted.rest), fitted.evaluation
    candidates = [c for c in catalogue(problem) if c.effect in ("cable_length", "hinge_position")][:6]
    before = log_evidence(evaluation)
    for promise in screen(problem, evaluation, candidates, mass_of(problem, evaluation)):
        if promise.candidate not in candidates:
            continue
        wide = extended(problem, (promise.candidate,))
        there = evaluate(wide, carried(wide, problem, evaluation.point))
        assert there is not None
        charged = before - log_evidence(there) - (there.cost - evaluation.cost)
        assert promise.charge == pytest.approx(charged, abs=0.02)
        assert charged > 0.5


def test_places_that_explain_as_much_make_an_effect_likelier_together() -> None:
    trailing = [("hinge", 3.8)] * 4 + [("hinge", 40.0), ("level", 2.0), ("cell", 1.0), ("cell", 9.0)]
    shared = shared_by_places(trailing)
    assert shared["hinge"] == pytest.approx(np.log(4.0))
    assert shared["level"] == pytest.approx(0.0)
    assert 0.0 < shared["cell"] < 1e-3
