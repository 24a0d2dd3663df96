"""With a discrepancy in the model its motion is what the recordings tell, whatever the model lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_model_rigs import random_sample
from test_simulate_identify import shaken

from rig_identification.estimate.force_noise import Discrepancy
from rig_identification.estimate.growing import misfit
from rig_identification.estimate.identify import _begun, _silent, fit_session, near_noise, pose_problem
from rig_identification.estimate.solve import evaluate
from rig_identification.model.effects import place
from rig_identification.model.equilibrium import find_rest, wrench_response
from rig_identification.search.ladder import LOST, Rung, begun, climbed, fitted_at
from rig_identification.search.levels import ALONE, LEVELS, at_level
from rig_identification.search.path import found_from
from rig_identification.simulate import simulate_session


@pytest.mark.parametrize("cables", [2, 3, 4])
def test_a_wrench_at_rest_moves_all_outputs_as_a_tether_pulls(cables: int) -> None:
    sample = random_sample(30 + cables, cables)
    model = sample.model(rods=True)
    rest = find_rest(model, sample.start)
    model = model.referred(rest.state)
    block = place.effects_block(model.cables)
    point = np.array([0.2, -0.3, 0.1])
    physics = model.physics.copy()
    physics[block + place.TETHER_POINT :][:3] = point
    response = wrench_response(model, rest)
    for axis in range(3):
        ends = []
        for sign in (1.0, -1.0):
            pulled = physics.copy()
            pulled[block + place.TETHER_PULL + axis] = sign * 0.5
            ends.append(find_rest(model.with_physics(pulled), rest.state).outputs[0])
        force = rest.state.R_world_body[axis]
        expected = (ends[0] - ends[1])[[0, 1, 2, *range(9, 12), *range(15, response.shape[0])]]
        found = response @ np.concatenate([force, np.cross(point, force)])
        found = found[[0, 1, 2, *range(9, 12), *range(15, response.shape[0])]]
        np.testing.assert_allclose(found, expected, atol=1e-6 * np.max(np.abs(expected)))


def test_levels_end_at_none() -> None:
    problem, theta, _ = pose_problem(simulate_session(shaken(3, 6.0), np.random.default_rng(3))[0])
    mass = float(problem.bench.parameters.elements(theta)[0])
    strengths = [at_level(problem, mass, k).discrepancy for k in range(len(LEVELS))]
    assert strengths[ALONE] is None
    force = [s.force for s in strengths if isinstance(s, Discrepancy)]
    assert force == sorted(force, reverse=True)
    assert force[0] == pytest.approx(LEVELS[0] * mass * problem.bench.rig.gravity)


def test_a_model_that_lacks_much_follows_the_data_and_asks_for_a_wrench_as_strong_as_what_it_lacks() -> None:
    spec = replace(
        shaken(14, 8.0),
        effects={
            "tether": (2000.0, 0.0, 0.0),
            "tether_pull": (150.0, 0.0, 0.0),
            "tether_point": (0.2, 0.9, 0.0),
        },
        doubts=False,
    )
    session, _ = simulate_session(spec, np.random.default_rng(5))
    problem, theta, held = pose_problem(session)
    start = _begun(problem, theta, held, _silent)
    mass = float(start.problem.bench.parameters.elements(start.point.theta)[0])
    strong = at_level(start.problem, mass, 0)
    found = found_from(strong, start.point)
    assert found is not None
    rung = begun(start.problem, start.point)
    assert rung is not None
    assert not rung.alone
    for run in rung.evaluation.runs:
        assert np.mean(run.residual**2) < 1.5
    for latent in rung.evaluation.point.latents:
        assert latent is not None
        # A pull of 150 N and a spring of 2 kN/m over centimetres
        assert 10.0 < np.sqrt(np.mean(latent[:, 0] ** 2)) < 400.0


def test_a_model_that_lacks_nothing_asks_for_no_wrench() -> None:
    session, _ = simulate_session(replace(shaken(14, 8.0), doubts=False), np.random.default_rng(6))
    problem, theta, held = pose_problem(session)
    start = _begun(problem, theta, held, _silent)
    rung = begun(start.problem, start.point)
    assert rung is not None
    assert rung.alone


def test_a_motion_that_an_effect_lost_is_found_again() -> None:
    """As where an effect enters with all of its amount beside wrenches that stood in for it."""
    session, _ = simulate_session(shaken(14, 8.0), np.random.default_rng(6))
    problem, theta, held = pose_problem(session)
    start = _begun(problem, theta, held, _silent)
    mass = float(start.problem.bench.parameters.elements(start.point.theta)[0])
    weight = mass * problem.bench.rig.gravity
    pushed = tuple(
        np.tile([0.3 * weight, 0.2 * weight, 0.0, 0.1 * weight, 0.0, 0.2 * weight], (run.grid.nodes, 1))
        for run in start.problem.runs
    )
    level = 2
    lost = evaluate(at_level(start.problem, mass, level), replace(start.point, latents=pushed))
    assert lost is None or misfit(lost) > LOST
    found = fitted_at(start.problem, replace(start.point, latents=pushed), level, 0)
    assert found is not None
    never_lost = found_from(at_level(start.problem, mass, level), start.point)
    assert never_lost is not None
    as_well = evaluate(at_level(start.problem, mass, level), never_lost)
    assert as_well is not None
    assert misfit(found.evaluation) < 1.05 * misfit(as_well)


@pytest.mark.parametrize(("damping", "alone"), [(0.0, True), (1.0, False)])
def test_near_the_noise_a_wrench_is_asked_for_only_where_something_is_left(
    damping: float, alone: bool
) -> None:
    spec = replace(shaken(10, 10.0), effects={"hinge_damping": (damping,)} if damping else {}, doubts=False)
    fitted = fit_session(simulate_session(spec, np.random.default_rng(5))[0])
    assert near_noise(fitted)
    rung = climbed(Rung(fitted.problem, fitted.evaluation, ALONE))
    assert rung.alone is alone
    if alone:
        assert rung.evaluation is fitted.evaluation
    else:
        assert rung.evidence > Rung(fitted.problem, fitted.evaluation, ALONE).evidence
        # The strongest wrench is not what the evidence asks for
        assert rung.level > 0
