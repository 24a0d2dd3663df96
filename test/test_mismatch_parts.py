"""Parts of the mismatch search against closed solutions."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from steady_zeros import steady_zeros_of_the_test  # noqa: F401
from test_estimate_prediction import short  # noqa: F401
from test_model_internal import with_rest
from test_model_rigs import thesis_case_14

from rig_identification.estimate.evidence import Run
from rig_identification.estimate.force_noise import WHITE
from rig_identification.estimate.prediction import linearise_run
from rig_identification.estimate.solve import Problem
from rig_identification.estimate.stretching import usual_stiffness
from rig_identification.estimate.whitening import whiten
from rig_identification.mismatch.latent import MissingWrench, strongest_push
from rig_identification.mismatch.law import law_of
from rig_identification.mismatch.locate import DRIVE
from rig_identification.mismatch.places import crossed, monomials, multiplied
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.rider_places import travel_along
from rig_identification.mismatch.riders import DAMPING, FREQUENCIES, Swing, rider_candidate
from rig_identification.mismatch.supports import (
    cable_elasticity,
    ceiling_candidate,
    largest_compliance,
)
from rig_identification.mismatch.unknown import missing_finding, push_finding
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import State

Array = NDArray[np.float64]


def swinging(force: Array, states: Array) -> MissingWrench:
    """A missing force (N, 3) through the datum of a body that does not turn."""
    nodes = states.shape[0]
    wrench = np.concatenate([force, np.zeros((nodes, 3))], axis=1)
    return MissingWrench("run_1", 0.01 * np.arange(nodes), wrench, np.tile(np.eye(3), (nodes, 1, 1)), states)


def motion(nodes: int = 2000) -> Array:
    """A swing along x and y at two frequencies, with its velocity."""
    t = 0.01 * np.arange(nodes)
    states = np.zeros((nodes, 12))
    for i, (size, omega) in enumerate(((0.3, 2.4), (0.2, 3.1))):
        states[:, i] = size * np.sin(omega * t + i)
        states[:, 6 + i] = size * omega * np.cos(omega * t + i)
    return states


def test_a_hardening_spring_is_told_as_the_cube_of_displacement() -> None:
    states, rng = motion(), np.random.default_rng(1)
    force = 0.2 * rng.standard_normal((2000, 3))
    force[:, 1] -= 4000.0 * states[:, 1] ** 3
    law = law_of(swinging(force, states))
    assert law is not None
    assert law.component == "force along y"
    assert law.terms[0] == "the cube of displacement along y"
    assert law.share > 0.9


def test_noise_follows_no_law() -> None:
    rng = np.random.default_rng(2)
    assert law_of(swinging(rng.standard_normal((2000, 3)), motion())) is None


def test_a_push_is_found_with_its_force_time_and_line() -> None:
    states, rng = motion(), np.random.default_rng(3)
    t = 0.01 * np.arange(2000)
    inside = (t > 8.0) & (t < 9.0)
    size = np.where(inside, 120.0 * np.sin(np.pi * (t - 8.0)), 0.0)
    missing = swinging(np.outer(size, [0.0, 1.0, 0.0]) + 0.5 * rng.standard_normal((2000, 3)), states)
    at = np.array([0.7, 0.1, -0.4])
    wrench = missing.wrench.copy()
    wrench[:, 3:] = np.cross(at, wrench[:, :3])
    push = strongest_push(replace(missing, wrench=wrench), np.array([0.5, 0.1, -0.5]))
    assert push.size == pytest.approx(120.0, abs=3.0)
    assert push.start == pytest.approx(8.05, abs=0.06)
    assert push.end == pytest.approx(8.95, abs=0.06)
    # Along the force itself no point can be told
    assert np.allclose(push.point[[0, 2]], at[[0, 2]], atol=0.05)


def test_a_push_is_told_as_a_force_from_outside() -> None:
    t, rig = 0.01 * np.arange(2000), thesis_case_14().rig
    size = np.where((t > 8.0) & (t < 9.0), 120.0 * np.sin(np.pi * (t - 8.0)), 0.0)
    found = push_finding(swinging(np.outer(size, [0.0, 1.0, 0.0]), motion()), rig, 7.5, 9.5)
    assert found.effect == "external_force"
    (times,) = found.where["times"]  # type: ignore[misc]
    assert times["recording"] == "run_1"
    assert times["start"] == pytest.approx(8.05, abs=0.06)
    assert times["end"] == pytest.approx(8.95, abs=0.06)
    assert found.parameters["peak_force_y"]["value"] == pytest.approx(120.0, abs=1.0)
    assert abs(found.parameters["peak_force_x"]["value"]) < 1.0


def test_what_nothing_explains_is_told_with_its_strength_axis_and_law() -> None:
    states, rig = motion(), thesis_case_14().rig
    force = 0.2 * np.random.default_rng(1).standard_normal((2000, 3))
    force[:, 1] -= 4000.0 * states[:, 1] ** 3
    missing = swinging(force, states)
    found = missing_finding(missing, rig, None)
    assert (found.effect, found.where["axis"], found.where["channel"]) == ("unknown", "y", None)
    rms = float(np.std(force[:, 1]))
    assert found.parameters["force"]["value"] == pytest.approx(rms, rel=0.02)
    assert "the cube of displacement along y" in found.statement
    # Where all but one device agree it is that device, and nothing acts on the body
    blamed = missing_finding(missing, rig, "imu")
    assert blamed.where["channel"] == "imu"
    assert blamed.statement.startswith("Everything but imu agrees")
    # Nobody measured what acts at the exciter: it may be anything that acts on the body
    driven = missing_finding(missing, rig, DRIVE)
    assert driven.where["channel"] is None
    assert "A force at the exciter" in driven.statement


def test_wind_is_told_at_the_point_where_it_acts() -> None:
    """A force of any course that turns a little tells its point in all three coordinates."""
    rng, rig, at = np.random.default_rng(5), thesis_case_14().rig, np.array([0.2, 0.0, 0.5])
    gusts = np.cumsum(rng.standard_normal((2000, 3)), axis=0) * [0.3, 1.0, 0.2]
    missing = swinging(gusts, motion())
    wrench = missing.wrench.copy()
    wrench[:, 3:] = np.cross(at, wrench[:, :3]) + 0.05 * rng.standard_normal((2000, 3))
    found = missing_finding(replace(missing, wrench=wrench), rig, None)
    np.testing.assert_allclose(found.where["position"], at, atol=0.01)  # type: ignore[arg-type]
    assert "It acts as one force does at (0.2" in found.statement
    wrench[:, 3:] += 20.0 * np.sin(np.arange(2000) / 150.0)[:, None]
    couple = missing_finding(replace(missing, wrench=wrench), rig, None)
    assert "as one force" not in couple.statement


def test_a_massless_rider_travels_as_its_equation_says() -> None:
    step, omega = 0.005, 2.0 * np.pi * 0.8
    t = step * np.arange(24000)
    force = np.zeros((t.size, 4))
    force[:, 0] = np.sin(omega * t)
    for frequency in FREQUENCIES[12:40:10]:
        own = 2.0 * np.pi * frequency
        answer = -1.0 / (own**2 - omega**2 + 2j * DAMPING * own * omega)
        q, push = travel_along(force, 0.0, frequency, DAMPING, step)
        late = t > 100.0
        expected = np.imag(answer * np.exp(1j * omega * t))
        assert np.max(np.abs(q[:, 0] - expected)[late]) < 1e-3 * abs(answer)
        assert np.max(np.abs(push[:, 0] - omega**2 * expected)[late]) < 2e-2 * omega**2 * abs(answer)
        assert np.max(np.abs(q[:, 1:])) == 0.0


def test_a_part_that_turns_adds_its_inertia_to_the_model() -> None:
    sample = thesis_case_14()
    model = with_rest(sample.model())
    bench = SimpleNamespace(rig=sample.rig, parameters=SimpleNamespace(model=model))
    swing = Swing("z", 2.0, turning=(("x", 2.5), ("z", 3.0)))
    problem: Any = SimpleNamespace(bench=bench)
    candidate, values = rider_candidate(problem, swing, 1200.0, 30.0, np.array([0.1, 0.2, -0.5]))
    built, parameters = candidate.built(model.with_internal(np.zeros((1, layout.INTERNAL_SIZE))))
    assert built.internal == 4
    blocks = built.physics[place.internal_block(4, 1) :].reshape(3, -1)
    assert blocks[:, layout.KIND].tolist() == [layout.RIDER, layout.TURNING, layout.TURNING]
    assert np.all(blocks[:, layout.LEADER] == 1)
    assert np.array_equal(blocks[:, layout.AXIS : layout.AXIS + 3], np.eye(3)[[2, 0, 2]])
    assert blocks[1:, layout.FREQUENCY].tolist() == [2.5, 3.0]
    own = {p.name.removeprefix("sprung_mass."): p.index for p in parameters}
    of_x, of_z = (place.internal_block(4, k) + layout.INERTIA for k in (2, 3))
    # Of the tensor's columns those on and above the diagonal: its product stands in the later one
    assert (own["inertia.x"], own["inertia.z"], own["inertia.xz"]) == (of_x, of_z + 2, of_z)
    assert built.physics[own["inertia.x"]] == next(p.nominal for p in parameters if p.index == of_x) > 0.0
    assert values["sprung_mass.mass"] == 30.0
    assert "turns about x, z" in candidate.sentence


def test_products_of_what_is_linear_in_a_place_are_those_at_every_place() -> None:
    rng = np.random.default_rng(4)
    a, b, u = rng.normal(size=(5, 3, 4)), rng.normal(size=(5, 3, 4)), rng.normal(size=3)
    there = np.array([1.0, *u])
    assert np.allclose(multiplied(a[:, 0], b[:, 1]) @ monomials(u), (a[:, 0] @ there) * (b[:, 1] @ there))
    assert np.allclose(multiplied(a[:, 0], b[0, 1]) @ monomials(u), (a[:, 0] @ there) * (b[0, 1] @ there))
    assert np.allclose(crossed(a, b) @ monomials(u), np.cross(a @ there, b @ there))


def test_supports_change_the_model_and_nothing_else() -> None:
    sample = thesis_case_14()
    model = with_rest(sample.model())
    ceiling, parameters = ceiling_candidate(sample.rig, model, 1200.0, 2).built(model)
    assert ceiling.internal == 1
    assert {p.name.split(".")[1] for p in parameters} == {"compliance", "frequency", "damping_ratio"}
    assert ceiling.physics[place.internal_block(4, 0) + layout.AXIS + 2] == 1.0
    elastic, shared = cable_elasticity(sample.rig, model, 1200.0).built(model)
    assert np.all(elastic.modes == layout.ELASTIC)
    assert len(shared[0].also) == 3
    # Three std: from webbing to what nothing tells from rigid
    usual = usual_stiffness(sample.rig, 1200.0)
    assert shared[0].value(-3.0) == pytest.approx(0.014 * usual, rel=0.05)
    assert shared[0].value(3.0) == pytest.approx(18.0 * usual, rel=0.05)
    assert shared[0].position(shared[0].value(0.7)) == pytest.approx(0.7)
    # A centimetre under the body's weight
    assert largest_compliance(sample.rig, 1200.0) * 1200.0 * sample.rig.gravity == pytest.approx(0.01)


@pytest.mark.usefixtures("steady_zeros")
def test_a_response_is_whitened_as_the_residuals_are(
    short: tuple[Problem, Run, Array, State],  # noqa: F811
) -> None:
    """One filter, worked out beforehand, does what the Kalman pass does to columns of a Jacobian."""
    problem, run, theta, start = short
    nominal = linearise_run(problem.bench, run, theta, start, extra_noise=np.diag([2.0] * 3 + [1.0] * 3))
    assert nominal is not None
    wrenches = np.random.default_rng(2).normal(size=(run.grid.nodes, 6, 3))
    silent = replace(nominal.noise, Q=np.zeros_like(nominal.noise.Q))
    deaf = replace(nominal, noise=silent, variance=np.ones_like(nominal.variance))
    steady = np.array([[0.9, 0.1], [-0.2, 0.8]])
    for follow, smooth in product((WHITE, steady), (False, True)):
        nominal = replace(nominal, noise=replace(nominal.noise, follow=follow))
        columns = np.column_stack([nominal.plain, whitened_response(deaf, wrenches, smooth=smooth)])
        A, B, _, _, _ = nominal.motion.derivatives
        at, H, D = nominal.nodes, nominal.row_H, nominal.row_D
        whiten(A, B, nominal.noise.Q, nominal.latent, at, H, D, nominal.variance, columns, follow)
        assert whitened_response(nominal, wrenches, smooth=smooth) == pytest.approx(columns[:, 1:], abs=1e-9)


@pytest.mark.usefixtures("steady_zeros")
def test_a_wrench_moves_every_sample_as_running_the_model_again_does(
    short: tuple[Problem, Run, Array, State],  # noqa: F811
) -> None:
    problem, run, theta, start = short
    nominal = linearise_run(problem.bench, run, theta, start, start_only=True)
    assert nominal is not None
    wrench = np.zeros((run.grid.nodes, 6))
    # Smooth: a sample between two nodes is read off the nearest of them
    rise = np.sin(np.linspace(0.0, np.pi, run.grid.nodes)) ** 2
    wrench[:, 1], wrench[:, 5] = 5.0 * rise, -2.0 * rise
    moved = linearise_run(problem.bench, run, theta, start, start_only=True, latent=wrench)
    assert moved is not None
    # What the noise is taken to be moves with the latent wrench: compare before whitening
    plain = (nominal.plain - moved.plain) / np.sqrt(nominal.variance)
    assert np.max(np.abs(plain)) > 0.5
    alone = replace(nominal, noise=replace(nominal.noise, Q=np.zeros_like(nominal.noise.Q)))
    change = whitened_response(alone, wrench[:, :, None])[:, 0]
    assert np.max(np.abs(plain - change)) < 0.05 * np.max(np.abs(change))
