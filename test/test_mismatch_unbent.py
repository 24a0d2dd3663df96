"""What is wrong by many tolerances is looked for where nothing is bent to swallow it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import fit_session
from rig_identification.estimate.parameters import INERTIAL
from rig_identification.estimate.solve import evaluate
from rig_identification.mismatch.amounts import stretching
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import Promise, with_reference
from rig_identification.mismatch.trial import VERY_FAR, at_minimum, attempt, mass_of
from rig_identification.mismatch.unbent import MOST, at_first, best_of, likely, unbent
from rig_identification.simulate import simulate_session

#: What the first cable is bent to, in tolerances.
BENT = 2.5


@pytest.fixture(scope="module")
def fitted() -> Fitted:
    session = simulate_session(shaken(14, 6.0), np.random.default_rng(8))[0]
    found = fit_session(session, lambda stage, share: None, None)
    return replace(found, problem=with_reference(found.problem, found.rest))


def test_a_rig_is_straightened_and_its_body_stays(fitted: Fitted) -> None:
    theta = fitted.evaluation.point.theta.copy()
    theta[INERTIAL] = BENT
    bent = replace(fitted.evaluation, point=replace(fitted.evaluation.point, theta=theta))
    straight = unbent(fitted.problem, bent)
    assert straight is not None
    assert straight.point.theta[:INERTIAL] == pytest.approx(theta[:INERTIAL])
    bounded = [i for i, q in enumerate(fitted.problem.bench.parameters.free, start=INERTIAL) if q.bounded]
    assert INERTIAL in bounded
    assert np.all(straight.point.theta[bounded] == 0.0)


def test_first_order_is_taken_about_a_minimum(fitted: Fitted) -> None:
    theta = fitted.evaluation.point.theta.copy()
    theta[INERTIAL] += BENT
    bent = evaluate(fitted.problem, replace(fitted.evaluation.point, theta=theta))
    assert bent is not None
    assert bent.cost > fitted.evaluation.cost + 3.0
    assert at_minimum(fitted.problem, bent).cost == pytest.approx(fitted.evaluation.cost, abs=1.0)


def test_the_better_of_two_starts_is_kept(fitted: Fitted) -> None:
    assert fitted.guess is not None
    first = at_first(fitted.problem, fitted.evaluation, fitted.guess.theta)
    assert first is not None
    assert first.cost > fitted.evaluation.cost
    gain = next(c for c in catalogue(fitted.problem) if c.effect == "load_cell_gain")
    starts = [first, fitted.evaluation]
    best, _ = best_of(fitted.problem, starts, Promise(gain, 1.0, {}), UNLIMITED)
    alone, same = best_of(fitted.problem, starts[:1], Promise(gain, 1.0, {}), UNLIMITED)
    assert best is not None
    assert alone is not None
    assert best.evidence >= alone.evidence
    # One start says nothing of another one; two of the same do
    assert not same
    assert best_of(fitted.problem, starts[1:] * 2, Promise(gain, 1.0, {}), UNLIMITED)[1]


def test_screenings_are_tried_in_turn_and_slow_fits_are_not(fitted: Fitted) -> None:
    candidates = catalogue(fitted.problem)
    bent = [Promise(c, 10.0, {}) for c in candidates if c.effect in ("tether", "load_cell_gain")]
    straight = [Promise(c, 5.0, {}) for c in candidates if c.effect == "level_error"]
    tried = [p.candidate.effect for p in likely(bent, straight)]
    assert tried[:4] == ["load_cell_gain", "level_error", "load_cell_gain", "level_error"]
    assert "tether" not in tried
    assert len(tried) <= 2 * MOST


def test_what_rings_is_given_up_where_the_first_second_shows_much_more_than_it_explains() -> None:
    """A cell that reads a fifth too much is off from the first sample on, whatever the cables' stiffness."""
    spec = shaken(14, 6.0)
    name = f"{spec.rig.cables[0].name}.load_cell_gain"
    session = simulate_session(replace(spec, effects={name: (0.2,)}), np.random.default_rng(8))[0]
    found = fit_session(session, lambda stage, share: None, None)
    problem = with_reference(found.problem, found.rest)
    assert misfit(found.evaluation) > VERY_FAR
    stretched = stretching(problem, found.evaluation, mass_of(problem, found.evaluation))
    assert stretched is not None
    assert attempt(problem, found.evaluation, stretched) is None
