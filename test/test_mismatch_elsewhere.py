"""What promises about as much at another frequency gets a second start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import ORDINARY, fit_ideal
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.amounts import CEILING_FREQUENCIES, supports
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.first_fits import begun
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.riders import Swing, rider_candidate
from rig_identification.mismatch.screen import ELSEWHERE, Promise, _peaks
from rig_identification.mismatch.search import trials
from rig_identification.mismatch.standing import short_pieces
from rig_identification.mismatch.trial import mass_of
from rig_identification.simulate import simulate_session

#: kg, Hz: 0.5 % of the body, at rest somewhere in it.
LIQUID, RATE, PLACE = 6.0, 0.8, (1.2, 1.0, -0.8)


@pytest.mark.parametrize(
    ("gains", "chosen"),
    [
        ([1.0, 9.0, 2.0, 3.0, 10.0, 4.0], [4, 1]),  # a peak that comes close
        ([1.0, 7.0, 2.0, 3.0, 10.0, 4.0], [4]),  # one that does not
        ([1.0, 2.0, 9.5, 10.0, 9.9, 1.0], [3]),  # a neighbour is no peak
        ([9.0, 1.0, 2.0, 10.0], [3, 0]),  # at the ends
        ([5.0], [0]),
        ([10.0, 9.6, 9.8, 9.0, 3.0, 8.5, 2.0], [0, 5]),  # beyond a valley, before a dent that comes closer
        ([10.0, 9.6, 9.8, 3.0, 1.0], [0, 2]),  # a dent where nothing else comes close
    ],
)
def test_the_best_peak_and_the_next(gains: list[float], chosen: list[int]) -> None:
    assert _peaks(np.array(gains)) == chosen
    assert 7.0 < ELSEWHERE * 10.0 < 9.0


@pytest.fixture(scope="module")
def swinging() -> tuple[Problem, Evaluation]:
    """A session with liquid, seen by a model without it; all else as it is."""
    effects = {
        "liquid_slosh.mass": (LIQUID,),
        "liquid_slosh.frequency": (RATE,),
        "liquid_slosh.damping_ratio": (0.02,),
        "liquid_slosh.position": PLACE,
    }
    return seen_by_the_true_body(replace(shaken(14, 8.0), effects=effects, doubts=False), 5)


def _promised(problem: Problem, evaluation: Evaluation, frequency: float) -> Promise:
    swing = Swing("xy", frequency)
    candidate, values = rider_candidate(problem, swing, mass_of(problem, evaluation), LIQUID, np.array(PLACE))
    return Promise(candidate, 100.0, values, 0.9)


@pytest.mark.long
def test_the_start_that_comes_to_less_stays(swinging: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = swinging
    wrong, right = (_promised(problem, evaluation, f) for f in (3.0 * RATE, RATE))
    for first, second in ((wrong, right), (right, wrong)):
        promise = replace(first, elsewhere=(second,))
        (trial,) = begun(problem, evaluation, [promise], False, lambda stage: None, UNLIMITED)
        found = trial.problem.bench.parameters.named(trial.evaluation.point.theta)
        assert found["liquid_slosh.frequency"] == pytest.approx(RATE, rel=0.03)
        assert misfit(trial.evaluation) < 1.05
    (alone,) = begun(problem, evaluation, [wrong], False, lambda stage: None, UNLIMITED)
    assert misfit(alone.evaluation) > 1.05


def test_a_ceiling_is_promised_at_another_frequency_too() -> None:
    effects = {"ceiling_compliance.stiffness": (0.0, 0.0, 4e6), "ceiling_compliance.mass": (300.0,)}
    problem, evaluation = seen_by_the_true_body(replace(shaken(14, 4.0), effects=effects, doubts=False), 5)
    promises = supports(problem, evaluation, mass_of(problem, evaluation))
    (ceiling,) = (p for p in promises if p.candidate.where["axis"] == "z")
    for promise in (ceiling, *ceiling.elsewhere):
        nominal = {p.name: p.nominal for p in promise.candidate.parameters}
        assert nominal["ceiling.frequency.z"] in CEILING_FREQUENCIES
        assert promise.gain > ELSEWHERE * ceiling.gain or promise is ceiling
    assert len(ceiling.elsewhere) <= 1


@pytest.mark.long
def test_liquid_is_found_beside_cables_that_stretch() -> None:
    """Both change the model: each alone leaves far more than noise."""
    effects = {
        "cable_elasticity": (6e6,),
        "cable_damping_ratio": (0.02,),
        "liquid_slosh.mass": (15.0,),
        "liquid_slosh.frequency": (1.1,),
        "liquid_slosh.damping_ratio": (0.03,),
        "liquid_slosh.position": PLACE,
    }
    spec = replace(shaken(14, 10.0), effects=effects, doubts=False)
    made, _ = simulate_session(spec, np.random.default_rng(4))
    problem, evaluation = short_pieces(fit_ideal(made, lambda stage, share: None)) or (None, None)
    assert problem is not None
    assert evaluation is not None
    found = trials(problem, evaluation, catalogue(problem), ORDINARY, lambda stage: None, more=True)
    assert found.led
    assert found.done[0].candidate.label == "cable_elasticity"
    assert found.beside[0].candidate.label == "liquid_slosh"
    assert misfit(found.beside[0].evaluation) < 1.05
