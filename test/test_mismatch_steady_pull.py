"""A hose of which only the pull shows: it is there at rest and in motion, however stiff it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_mismatch_two_errors import wrong
from test_simulate_identify import shaken

from rig_identification.estimate.estimates import parameter_estimates
from rig_identification.estimate.identify import ORDINARY, fit_session, near_noise
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.hypotheses import catalogue, count_of, needed_gain, worth_a_fit
from rig_identification.mismatch.pairs import first_of_two
from rig_identification.mismatch.screen import Promise, screen, with_reference
from rig_identification.mismatch.search import trials
from rig_identification.mismatch.trial import mass_of
from rig_identification.recording import Session
from rig_identification.simulate import simulate_session

#: N along y, and N/m: 60 mm of travel change the pull by a thirtieth of what it is.
PULL, STIFFNESS, PLACE = 40.0, 20.0, (0.7, 0.9, -0.8)


def _promised(session: Session) -> tuple[Problem, Evaluation, list[Promise]]:
    fitted = fit_session(session)
    assert near_noise(fitted)
    problem = with_reference(fitted.problem, fitted.rest)
    return (
        problem,
        fitted.evaluation,
        screen(problem, fitted.evaluation, catalogue(problem), mass_of(problem, fitted.evaluation)),
    )


@pytest.fixture(scope="module")
def pulled() -> tuple[Problem, Evaluation, list[Promise]]:
    effects = {
        "tether": (0.0, STIFFNESS, 0.0),
        "tether_pull": (0.0, PULL, 0.0),
        "tether_point": PLACE,
    }
    spec = replace(shaken(12, 12.0), effects=effects)
    return _promised(simulate_session(spec, np.random.default_rng(4))[0])


def test_it_is_a_hose_and_no_two_errors_of_cells(pulled: tuple[Problem, Evaluation, list[Promise]]) -> None:
    problem, evaluation, promises = pulled
    candidates = catalogue(problem)
    hose = next(p for p in promises if p.candidate.label == "tether y")
    assert hose.steady
    assert hose in worth_a_fit(promises, count_of(candidates))
    done = trials(problem, evaluation, candidates, ORDINARY, lambda label: None, promises, more=True).done
    assert done[0].candidate.label == "tether y"
    told = {q.name: q for q in parameter_estimates(done[0].problem, done[0].evaluation)}
    pull, stiffness = told["tether.pull.y"], told["tether.stiffness.y"]
    assert abs(pull.value - PULL) < 3.0 * pull.std < 0.5 * PULL
    assert abs(stiffness.value - STIFFNESS) < 3.0 * stiffness.std


def test_a_cells_zero_is_no_steady_pull() -> None:
    made = simulate_session(shaken(12, 12.0), np.random.default_rng(4))[0]
    loud = replace(made, recordings=tuple(wrong(r, 0.0, PULL) for r in made.recordings))
    problem, _, promises = _promised(loud)
    worthy = worth_a_fit(promises, count_of(catalogue(problem)))
    assert any(p.candidate.label.startswith("load_cell_offset") for p in worthy)
    assert not any(p.steady for p in worthy)


def test_a_pair_does_not_lead_where_one_slow_hypothesis_is_as_likely(
    pulled: tuple[Problem, Evaluation, list[Promise]],
) -> None:
    problem, evaluation, promises = pulled
    count = count_of(catalogue(problem))
    hose = next(p for p in promises if p.candidate.label == "tether y")
    # First order may think little of either: then two cells' zeros lead, were it not for the hose's fit
    faintly = [replace(p, gain=0.0 if p.candidate.slow else 0.3 * p.gain) for p in promises if p is not hose]
    faintly.append(replace(hose, gain=needed_gain(hose.candidate, count) + 1.0))
    led = first_of_two(problem, evaluation, faintly, count, 3.0, ORDINARY, lambda label: None, UNLIMITED)
    assert led is not None
    assert not led.leads
    assert led.instead is not None
    assert led.instead.candidate.label == "tether y"
