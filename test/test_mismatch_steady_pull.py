"""A hose of which only the pull shows: it is there at rest and in motion, however stiff it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken
from wrong_sessions import wrong

from rig_identification.estimate.estimates import parameter_estimates
from rig_identification.estimate.identify import fit_session, near_noise
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.hypotheses import catalogue, count_of
from rig_identification.mismatch.opened import Promise, with_reference
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import mass_of
from rig_identification.recording import Session
from rig_identification.search.expand import Standing, children, worthy
from rig_identification.search.ladder import Rung
from rig_identification.search.levels import ALONE
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
    assert hose in worthy(promises, count_of(candidates))
    first = children(
        problem,
        Standing(Rung(problem, evaluation, ALONE)),
        candidates,
        UNLIMITED,
        lambda label: None,
        promises,
    )[0]
    assert first.label == "tether y"
    told = {q.name: q for q in parameter_estimates(first.rung.problem, first.rung.evaluation)}
    pull, stiffness = told["tether.pull.y"], told["tether.stiffness.y"]
    assert abs(pull.value - PULL) < 3.0 * pull.std < 0.5 * PULL
    assert abs(stiffness.value - STIFFNESS) < 3.0 * stiffness.std


def test_a_cells_zero_is_no_steady_pull() -> None:
    made = simulate_session(shaken(12, 12.0), np.random.default_rng(4))[0]
    loud = replace(made, recordings=tuple(wrong(r, 0.0, PULL) for r in made.recordings))
    problem, _, promises = _promised(loud)
    fitted = worthy(promises, count_of(catalogue(problem)))
    assert fitted[0].candidate.label.startswith("load_cell_offset")
