"""What rest alone explains is fitted to the motion before a hose, whose fit takes a minute (ADR 0039)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import ORDINARY, fit_ideal
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.look import Look
from rig_identification.mismatch.outcome import NOTHING, Alone
from rig_identification.mismatch.screen import Promise
from rig_identification.simulate import simulate_session

#: m that an upper hinge is drawn off its place.
OFF = 0.018


@pytest.fixture(scope="module")
def look() -> Look:
    made, _ = simulate_session(replace(shaken(14, 10.0), doubts=False), np.random.default_rng(4))
    cables = list(made.rig.cables)
    point = cables[1].ceiling_point + np.array([0.0, OFF, 0.0])
    cables[1] = replace(cables[1], ceiling_point=point)
    drawn = replace(made, rig=replace(made.rig, cables=tuple(cables)))
    fitted = fit_ideal(drawn, lambda stage, share: None).fitted
    problem, evaluation = fitted.problem, fitted.evaluation
    candidates = catalogue(problem)
    hose = next(c for c in candidates if c.effect == "tether")
    assert hose.slow
    measured = Alone(measured=lambda _: pytest.fail("the motion is not asked"))
    return Look(
        problem,
        evaluation,
        problem,
        evaluation,
        candidates,
        [Promise(hose, 1e3, {}, 1.0)],
        1e3,
        ORDINARY,
        True,
        lambda label: None,
        UNLIMITED,
        measured,
    )


def test_a_hinge_that_rest_singles_out_is_fitted_before_a_hose(look: Look) -> None:
    look.as_it_hangs()
    assert look.tried
    best = max(look.tried, key=lambda t: t.evidence)
    assert best.candidate.label == "hinge_position cable_2 ceiling y"
    assert look.at_noise


def test_what_is_fitted_soon_needs_no_rest_before(look: Look) -> None:
    soon = next(c for c in look.candidates if not c.slow)
    quick = replace(look, promises=[Promise(soon, 1e3, {}, 1.0)], tried=[])
    quick.as_it_hangs()
    assert not quick.tried
    beside = replace(look, alone=NOTHING, tried=[])
    beside.as_it_hangs()
    assert not beside.tried
