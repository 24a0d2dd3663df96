"""What the static recordings ask for by themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_simulate_identify import shaken

from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.identify import ORDINARY, fit_ideal, fit_session
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.along_measured import Along
from rig_identification.mismatch.at_rest import ALIKE, at_rest, both_at_rest, from_rest
from rig_identification.mismatch.budget import Budget
from rig_identification.mismatch.candidate import Candidate
from rig_identification.mismatch.first_fits import AT_NOISE
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.outcome import Alone
from rig_identification.mismatch.screen import with_reference
from rig_identification.mismatch.search import trials
from rig_identification.mismatch.standing import short_pieces
from rig_identification.mismatch.trial import VERY_FAR, attempt, fitted_from
from rig_identification.recording import Recording
from rig_identification.simulate import simulate_session

#: m: one of four cables too long, so that three carry nearly all.
LONGER = 0.02


def _fitted(effects: dict[str, tuple[float, ...]], seed: int = 2) -> tuple[Problem, Evaluation]:
    spec = replace(shaken(10, 6.0), effects=effects, doubts=False)
    fitted = fit_session(simulate_session(spec, np.random.default_rng(seed))[0])
    return with_reference(fitted.problem, fitted.rest), fitted.evaluation


@pytest.fixture(scope="module")
def longer() -> tuple[Problem, Evaluation]:
    return _fitted({"cable_length": (0.0, 0.0, LONGER, 0.0)})


def test_a_cable_that_is_too_long_is_asked_for_first(longer: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = longer
    asked = at_rest(problem, evaluation, catalogue(problem))
    first = asked[0].promise
    assert first.candidate.label == "cable_length cable_3"
    (value,) = first.values.values()
    assert abs(value - first.candidate.parameters[0].nominal - LONGER) < 0.005
    kinds = [a.promise.candidate.kind for a in asked]
    assert max(kinds.count(k) for k in kinds) <= ALIKE


def test_from_there_the_motion_is_explained(longer: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = longer
    assert misfit(evaluation) > NEAR_SQUARE
    first = at_rest(problem, evaluation, catalogue(problem))[0]
    start = from_rest(problem, evaluation, first)
    assert start is not None
    trial = attempt(problem, start, first.promise)
    assert trial is not None
    assert misfit(trial.evaluation) < 1.1


def test_a_rig_as_described_asks_for_nothing_at_rest() -> None:
    problem, evaluation = _fitted({"hinge_damping": (30.0,)})
    assert at_rest(problem, evaluation, catalogue(problem)) == []


def test_nothing_is_asked_without_static_recordings_or_time(longer: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = longer
    candidates = catalogue(problem)
    bare = replace(problem, rests=())
    assert at_rest(bare, evaluation, candidates) == []
    assert at_rest(problem, evaluation, candidates, Budget(0.0)) == []


#: rad about y of an IMU that all else contradicts, and kg of liquid beside it.
TURNED, LIQUID = 0.05, 20.0


def _turned(recording: Recording, angle: float = TURNED) -> Recording:
    imu = recording.imu
    assert imu is not None
    turn = Rotation.from_rotvec([0.0, angle, 0.0]).inv()
    values = np.concatenate([turn.apply(imu.values[:, :3]), turn.apply(imu.values[:, 3:])], axis=1)
    return replace(recording, imu=replace(imu, values=values))


def test_what_rest_is_certain_of_leads_to_what_swings_beside_it() -> None:
    """Liquid keeps the turned IMU from leaving only noise; rest asks for it all the same."""
    effects = {
        "liquid_slosh.mass": (LIQUID,),
        "liquid_slosh.frequency": (0.9,),
        "liquid_slosh.damping_ratio": (0.01,),
        "liquid_slosh.position": (0.9, 2.0, -0.6),
    }
    spec = replace(shaken(14, 6.0), effects=effects, doubts=False)
    made, _ = simulate_session(spec, np.random.default_rng(2))
    made = replace(made, recordings=tuple(_turned(r) for r in made.recordings))
    fitted = fit_session(made)
    problem = with_reference(fitted.problem, fitted.rest)
    found = trials(problem, fitted.evaluation, catalogue(problem), ORDINARY, lambda label: None, more=True)
    assert found.led
    assert found.done[0].candidate.effect == "imu_misalignment"
    turn = found.done[0].problem.bench.parameters.named(found.done[0].evaluation.point.theta)
    assert abs(turn["imu.orientation.y"] - TURNED) < 0.2 * TURNED
    assert misfit(found.done[0].evaluation) > NEAR_SQUARE


def test_what_the_scale_did_not_weigh_comes_before_what_moves_beside_it() -> None:
    """Rest tells the rotor, and beside it the hinges show: the measured motion is not asked."""
    problem, evaluation = _fitted({"exciter_rotor": (25.0,), "hinge_damping": (300.0,)}, seed=3)
    assert misfit(evaluation) > VERY_FAR
    asked: list[str] = []

    def measured(candidates: list[Candidate]) -> Along:
        asked.append("along the measured motion")
        return Along([])

    found = trials(
        problem,
        evaluation,
        catalogue(problem),
        ORDINARY,
        asked.append,
        more=True,
        alone=Alone(measured=measured),
    )
    assert found.led
    assert found.done[0].candidate.effect == "exciter_rotor"
    assert found.beside[0].candidate.effect == "hinge_damping"
    assert "along the measured motion" not in asked


@pytest.fixture(scope="module")
def tilted_and_turned() -> tuple[Problem, Evaluation]:
    """A ceiling off level beside a turned IMU: both show at rest, neither explains it."""
    spec = replace(shaken(10, 12.0), effects={"level_error": (0.0, TILTED)}, doubts=False)
    made, _ = simulate_session(spec, np.random.default_rng(2))
    made = replace(made, recordings=tuple(_turned(r, SLIGHTLY) for r in made.recordings))
    problem, evaluation = short_pieces(fit_ideal(made, lambda stage, share: None)) or (None, None)
    assert problem is not None
    assert evaluation is not None
    return problem, evaluation


#: rad about y, of the ceiling and of the IMU: neither takes nearly all away.
TILTED, SLIGHTLY = 0.02, 0.033
BOTH = {"level_error ceiling y", "imu_misalignment imu"}


def test_two_errors_that_show_at_rest_are_found_there(tilted_and_turned: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = tilted_and_turned
    candidates = catalogue(problem)
    asked = at_rest(problem, evaluation, candidates)
    assert not any(a.settles for a in asked)
    pairs = both_at_rest(problem, evaluation, asked, candidates)
    # Which number of the IMU it is rest does not say
    assert BOTH in [{p.first.label, p.second.label} for p in pairs]
    assert both_at_rest(problem, evaluation, asked, candidates, Budget(0.0)) == []


def test_the_motion_confirms_what_rest_asks_two_of(tilted_and_turned: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = tilted_and_turned
    candidates = catalogue(problem)
    pairs = both_at_rest(problem, evaluation, at_rest(problem, evaluation, candidates), candidates)
    fits = [(p, fitted_from(p.second, p.problem, p.starts)) for p in pairs]
    left = {
        frozenset((p.first.label, p.second.label)): misfit(t.evaluation) for p, t in fits if t is not None
    }
    assert left.pop(frozenset(BOTH)) < AT_NOISE
    # What is alike at rest is not in the motion
    assert left
    assert min(left.values()) > AT_NOISE


def test_one_error_at_rest_is_no_pair(longer: tuple[Problem, Evaluation]) -> None:
    problem, evaluation = longer
    candidates = catalogue(problem)
    assert both_at_rest(problem, evaluation, at_rest(problem, evaluation, candidates), candidates) == []
