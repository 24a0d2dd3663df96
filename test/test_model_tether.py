"""A taut hose: it keeps energy, does not push, and far from its wall is a spring along its line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from test_model_conservation import kinetic_and_potential
from test_model_derivatives import SUBSTEPS, assert_close, drive_of, physics_derivative
from test_model_rigs import Sample, moving, random_sample, thesis_case_14
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.estimates import estimates
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import attempt, finished, mass_of
from rig_identification.model.effects import place
from rig_identification.model.motion import Input, Motion, RigModel, simulate

Array = NDArray[np.float64]
POINT = np.array([0.3, 0.5, -0.4])
STIFFNESS = 20000.0


def tied(sample: Sample, model: RigModel, stiffness: float, pull: Array, reach: Array) -> RigModel:
    """The model with a tether that pulls by ``pull`` where the sample starts; a spring alike on all axes."""
    physics = model.referred(sample.start).physics
    block = place.effects_block(model.cables)
    physics[block + place.TETHER_POINT :][:3] = POINT
    physics[block + place.TETHER_STIFFNESS :][:3] = stiffness
    physics[block + place.TETHER_PULL :][:3] = pull
    physics[block + place.TETHER_REACH :][:3] = reach
    return model.with_physics(physics)


def stretch_of(sample: Sample, motion: Motion, pull: Array, reach: Array) -> Array:
    """(N,) m that the hose would be longer than without load, were it straight."""
    home = sample.start.position + sample.start.R_world_body @ POINT
    at = motion.states[:, :3] + motion.R_world_body @ POINT
    length = np.linalg.norm(home + reach - at, axis=1)
    return np.asarray(
        length - np.linalg.norm(reach) + pull @ reach / np.linalg.norm(reach) / STIFFNESS, dtype=np.float64
    )


def test_a_hose_that_goes_slack_and_taut_keeps_energy() -> None:
    sample = thesis_case_14()
    reach, pull = np.array([0.9, -1.2, 0.2]), np.array([60.0, -80.0, 0.0])
    plain = sample.model(rods=True)
    model = tied(sample, plain, STIFFNESS, pull, reach)
    motion = simulate(model, moving(sample, plain, 2), Input.none(1001, 0.01), substeps=20)
    kinetic, potential = kinetic_and_potential(model, motion)
    stretch = stretch_of(sample, motion, pull, reach)
    assert np.min(stretch) < -0.01
    assert np.max(stretch) > 0.01
    stored = 0.5 * STIFFNESS * np.maximum(stretch, 0.0) ** 2
    assert np.max(stored) > 0.03 * np.ptp(kinetic)
    # The kink of its force costs the integrator its order, at one substep each time
    assert np.ptp(kinetic + potential + stored) < 1e-5 * np.ptp(kinetic)


def test_what_damps_a_hose_takes_energy_while_it_is_taut() -> None:
    """Its power is damping times the square of the rate of its length."""
    sample, damping, step = thesis_case_14(), 300.0, 0.0025
    reach, pull = np.array([0.9, -1.2, 0.2]), np.array([3000.0, -4000.0, 0.0])
    plain = sample.model(rods=True)
    model = tied(sample, plain, STIFFNESS, pull, reach)
    physics = model.physics.copy()
    physics[place.effects_block(model.cables) + place.TETHER_DAMPING] = damping
    model = model.with_physics(physics)
    motion = simulate(model, moving(sample, plain, 2), Input.none(2001, step), substeps=4)
    kinetic, potential = kinetic_and_potential(model, motion)
    stretch = stretch_of(sample, motion, pull, reach)
    rate = np.gradient(stretch, step)
    assert np.all(STIFFNESS * stretch + damping * rate > 0.0)
    energy = kinetic + potential + 0.5 * STIFFNESS * stretch**2
    power = damping * rate**2
    taken = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1])) * step])
    assert taken[-1] > 0.05 * np.ptp(kinetic)
    np.testing.assert_allclose(energy[0] - energy, taken, atol=2e-3 * taken[-1])


def test_a_hose_to_a_wall_far_away_is_a_spring_along_its_line() -> None:
    """What it turns by shrinks as one over its reach."""
    sample = thesis_case_14()
    plain = sample.model(rods=True)
    start, drive = moving(sample, plain, 3), Input.none(201, 0.01)
    spring = np.array([STIFFNESS, 0.0, 0.0])
    pull = np.array([3000.0, 0.0, 0.0])
    along = tied(sample, plain, 0.0, pull, np.zeros(3))
    physics = along.physics.copy()
    physics[place.effects_block(plain.cables) + place.TETHER_STIFFNESS :][:3] = spring
    expected = simulate(along.with_physics(physics), start, drive).states
    off = [
        np.max(
            np.abs(
                simulate(tied(sample, plain, STIFFNESS, pull, np.array([far, 0.0, 0.0])), start, drive).states
                - expected
            )
        )
        for far in (1e3, 1e4)
    ]
    assert off[0] < 0.02
    assert off[1] == pytest.approx(0.1 * off[0], rel=0.1)


def test_derivatives_of_a_taut_hose() -> None:
    sample = random_sample(5, 3)
    plain = sample.model(rods=True)
    reach, pull = np.array([0.9, -1.2, 0.2]), np.array([9e3, -12e3, 0.0])
    model = tied(sample, plain, STIFFNESS, pull, reach)
    state, drive = moving(sample, plain, 5), drive_of(31, 0.01, 5)
    block = place.effects_block(model.cables)
    physics = model.physics.copy()
    physics[block + place.TETHER_DAMPING], physics[block + place.TETHER_PRELOAD] = 400.0, 900.0
    model = model.with_physics(physics)
    own = [
        block + first + i
        for first in (place.TETHER_STIFFNESS, place.TETHER_PULL, place.TETHER_POINT, place.TETHER_REACH)
        for i in range(3)
    ]
    own += [block + place.TETHER_DAMPING, block + place.TETHER_PRELOAD]
    exact = simulate(model, state, drive, directions=np.array(own), substeps=SUBSTEPS)
    assert exact.J is not None
    for k, entry in enumerate(own):
        numeric = physics_derivative(model, state, drive, entry, 0.01)
        assert_close(exact.J[:, :, k], numeric, str(entry - block), 1e-6)


def test_a_hose_that_comes_slack_is_told_with_its_own_stiffness_and_pull() -> None:
    """A spring in its place, which pushes half of the time, is softer by a tenth."""
    at, stiffness, pull = (0.2, 0.4, -0.3), 300.0, 9.0
    effects = {
        "tether": (stiffness, 0.0, 0.0),
        "tether_pull": (pull, 0.0, 0.0),
        "tether_point": at,
        "tether_reach": (1.2, 0.0, 0.0),
    }
    spec = replace(shaken(14, 12.0), effects=effects, doubts=False)
    problem, found = seen_by_the_true_body(spec, 3)
    promises = screen(problem, found, catalogue(problem), mass_of(problem, found))
    trial = attempt(problem, found, next(p for p in promises if p.candidate.effect == "tether"))
    assert trial is not None
    ended = finished(trial)
    assert ended is not None
    assert ended.evidence > trial.evidence + 10.0
    values = ended.problem.bench.parameters.named(ended.evaluation.point.theta)
    told = ended.candidate.told(estimates(ended.problem, ended.evaluation))
    value, std, _ = told["stiffness"]
    assert abs(value - stiffness) < 4.0 * std
    value, std, _ = told["preload"]
    assert abs(value - pull) < 3.0 * std < 1.5 * pull
    assert values["tether.reach.x"] > 0.0
