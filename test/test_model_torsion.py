"""Cables that resist being twisted: energy, the turn about the vertical, derivatives, a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_model_conservation import kinetic_and_potential
from test_model_derivatives import SUBSTEPS, assert_close, check_physics, drive_of, physics_derivative
from test_model_rigs import moving, random_sample, thesis_case_14
from test_model_threads import cables_in_body, having
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.estimates import estimates
from rig_identification.mismatch.hypotheses import catalogue
from rig_identification.mismatch.screen import screen
from rig_identification.mismatch.trial import attempt, fitted_to_its_end, mass_of
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.effects.cable_torsion import add_cable_torsion
from rig_identification.model.motion import Input, simulate

STIFFNESS, STIFF = 2e3, 100.0  # N m/rad: of the motion, and as a search meets it
TWISTS = np.array([150.0, -220.0, 90.0])  # N m, world: of cables that were clamped otherwise than they hang


def test_a_swing_on_cables_that_twist_keeps_its_energy() -> None:
    sample = thesis_case_14()
    plain = sample.model(rods=True)
    turned = Rotation.from_rotvec([0.1, -0.05, 0.4]).as_matrix() @ sample.start.R_world_body
    model = having(
        plain.referred(replace(sample.start, R_world_body=turned)), TORSION=STIFFNESS, TWISTED=TWISTS
    )
    motion = simulate(model, sample.start, Input.none(501, 0.01), substeps=8)
    stored = []
    for x, R in zip(motion.states, motion.R_world_body, strict=True):
        A = R @ turned.T
        w = 0.5 * np.array([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])
        along = cables_in_body(model, x[:3], R) @ R.T
        stored.append(np.sum(0.5 * STIFFNESS * (along @ w) ** 2 + (along @ w) * (along @ TWISTS)))
    kinetic, potential = kinetic_and_potential(model, motion)
    assert np.ptp(stored) > 0.01 * np.ptp(kinetic)
    assert np.ptp(kinetic + potential + np.array(stored)) < 1e-6 * np.ptp(kinetic)


def test_cables_that_hang_straight_take_all_of_a_turn_about_the_vertical() -> None:
    """n k times half the sine of twice the turn, and nothing else."""
    sample, turn = random_sample(3, 3), 0.4
    model = sample.model(rods=True).referred(sample.start)
    block = place.effects_block(model.cables)
    physics = having(model, TORSION=STIFFNESS).physics.copy()
    R = Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix() @ sample.start.R_world_body
    for i in range(model.cables):
        o = layout.cable_offset(i)
        hinge = sample.start.position + R @ physics[o + layout.BODY_POINT :][:3]
        physics[o + layout.CEILING_POINT :][:3] = hinge + np.array([0.0, 0.0, 1e3])
    x, wrench = np.concatenate([sample.start.position, np.zeros(9)]), np.zeros(6)
    add_cable_torsion(physics, block, model.modes, (0, model.cables), x, R, wrench)
    expected = [0.0, 0.0, -model.cables * STIFFNESS * np.sin(turn) * np.cos(turn)]
    np.testing.assert_allclose(R @ wrench[3:], expected, rtol=0.0, atol=1e-9 * STIFFNESS)
    np.testing.assert_allclose(wrench[:3], np.zeros(3), rtol=0.0, atol=1e-9 * STIFFNESS)


def test_derivatives() -> None:
    sample = random_sample(5, 3)
    model = having(sample.model(rods=True).referred(sample.start), TORSION=STIFFNESS, TWISTED=TWISTS)
    state, drive = moving(sample, model, 5), drive_of(61, 0.01, 5)
    o = layout.cable_offset(1)
    check_physics(model, state, drive, [o + layout.BODY_POINT + 1, o + layout.CEILING_POINT], 1e-6)
    entry = place.effects_block(model.cables) + place.TORSION
    exact = simulate(model, state, drive, directions=np.array([entry]), substeps=SUBSTEPS)
    assert exact.J is not None
    assert_close(exact.J[:, :, 0], physics_derivative(model, state, drive, entry, 1.0), "TORSION", 1e-6)
    alone = having(model, TORSION=0.0, TWISTED=np.zeros(3))
    entries = np.arange(entry, entry + 4)
    none = simulate(alone, state, drive, directions=entries, substeps=SUBSTEPS)
    assert none.J is not None
    for k, twisted in enumerate(entries):
        exact_of_one = physics_derivative(alone, state, drive, twisted, 1.0)
        assert_close(none.J[:, :, k], exact_of_one, f"TORSION + {k}", 1e-6)


@pytest.mark.parametrize("twist", [(0.0, 0.0, 0.0), (1.0, -6.0, 3.0)])
def test_cables_that_twist_are_found_as_stiff_and_as_twisted_as_they_are(twist: tuple[float, ...]) -> None:
    effects = {"cable_torsion": (STIFF,), "cable_torsion.twist": twist}
    spec = replace(shaken(14, 12.0), effects=effects, doubts=False)
    problem, found = seen_by_the_true_body(spec, 3)
    promises = screen(problem, found, catalogue(problem), mass_of(problem, found))
    torsion = next(p for p in promises if p.candidate.where.get("state") == "twisted at rest")
    ended = fitted_to_its_end(problem, found, torsion)
    assert ended is not None
    assert found.cost - ended.evaluation.cost > 1.0
    told = ended.candidate.told(estimates(ended.problem, ended.evaluation))
    assert list(told) == ["torsion_stiffness", "twist_x", "twist_y", "twist_z"]
    for (value, std, _), true in zip(told.values(), (STIFF, *twist), strict=True):
        assert abs(value - true) < 3.0 * std < STIFF


def test_a_hoses_pull_is_no_twist_of_cables_that_do_not_resist_it() -> None:
    effects = {"tether": (120.0, 0.0, 0.0), "tether_point": (0.3, 1.8, -0.9), "tether_pull": (30.0, 0.0, 0.0)}
    spec = replace(shaken(14, 12.0), effects=effects, doubts=False)
    problem, found = seen_by_the_true_body(spec, 3)
    promises = screen(problem, found, catalogue(problem), mass_of(problem, found))
    twisted = next(p for p in promises if p.candidate.where.get("state") == "twisted at rest")
    assert twisted.gain > 10.0
    assert attempt(problem, found, twisted) is None
    by_its_pull = replace(twisted, candidate=replace(twisted.candidate, per_amount=0.0))
    begun = attempt(problem, found, by_its_pull)
    assert begun is not None
    values = begun.problem.bench.parameters.named(begun.evaluation.point.theta)
    stiffness, *twists = (values[q.name] for q in twisted.candidate.parameters)
    assert np.linalg.norm(twists) > 0.3 * stiffness
