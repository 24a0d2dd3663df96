"""A law of one point's motion: what it keeps, what it takes, its derivatives, and how it is found."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from test_model_conservation import kinetic_and_potential
from test_model_derivatives import SUBSTEPS, assert_close, drive_of, physics_derivative
from test_model_rigs import Sample, moving, random_sample, thesis_case_14
from test_simulate_identify import seen_by_the_true_body, shaken

from rig_identification.estimate.estimates import estimates
from rig_identification.estimate.growing import misfit
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.mismatch.findings import finding
from rig_identification.mismatch.point_laws import law_finding, parts_of
from rig_identification.model.effects import place
from rig_identification.model.motion import Input, Motion, RigModel, simulate
from rig_identification.search.expand import Standing, children
from rig_identification.search.ladder import begun
from rig_identification.search.laws import promised_laws, sparse

Array = NDArray[np.float64]
POINT = np.array([0.3, 0.5, -0.4])
LINE = (0.7, 0.3)


def ruled(
    sample: Sample, model: RigModel, spring: tuple[float, ...], brake: tuple[float, ...], narrow: float = 0.0
) -> RigModel:
    """The model with a law about where the sample starts."""
    physics = model.referred(sample.start).physics
    block = place.effects_block(model.cables)
    physics[block + place.LAW_POINT :][:3] = POINT
    physics[block + place.LAW_SPRING :][:3] = spring
    physics[block + place.LAW_BRAKE :][:2] = brake
    physics[block + place.LAW_DIRECTION :][:2] = LINE
    physics[block + place.LAW_NARROW] = narrow
    physics[block + place.LAW_UPRIGHT] = 1.0
    return model.with_physics(physics)


def travel(sample: Sample, motion: Motion) -> Array:
    """(N, 3) m of the point from where it started."""
    home = sample.start.position + sample.start.R_world_body @ POINT
    return np.asarray(motion.states[:, :3] + motion.R_world_body @ POINT - home)


def test_a_spring_by_any_power_keeps_energy() -> None:
    sample = thesis_case_14()
    plain = sample.model(rods=True)
    spring = (4e3, -6e4, 3e6)
    motion = simulate(
        ruled(sample, plain, spring, (0.0, 0.0)), moving(sample, plain, 2), Input.none(1001, 0.01)
    )
    kinetic, potential = kinetic_and_potential(plain, motion)
    azimuth, elevation = LINE
    along = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    s = travel(sample, motion) @ along
    stored = spring[0] * s**2 / 2.0 + spring[1] * s**3 / 3.0 + spring[2] * s**4 / 4.0
    assert np.ptp(stored) > 0.03 * np.ptp(kinetic)
    assert np.ptp(kinetic + potential + stored) < 1e-6 * np.ptp(kinetic)


def test_a_brake_takes_the_power_that_it_says() -> None:
    sample = thesis_case_14()
    plain = sample.model(rods=True)
    linear, square, narrow = 80.0, 200.0, 3.0
    motion = simulate(
        ruled(sample, plain, (0.0, 0.0, 0.0), (linear, square), narrow),
        moving(sample, plain, 2),
        Input.none(1001, 0.01),
    )
    kinetic, potential = kinetic_and_potential(plain, motion)
    energy = kinetic + potential
    x = motion.states
    v = x[:, 6:9] + np.einsum("nij,nj->ni", motion.R_world_body, np.cross(x[:, 9:12], POINT))
    speed = np.linalg.norm(v, axis=1)
    fade = np.exp(-narrow * np.sum(travel(sample, motion) ** 2, axis=1))
    power = (linear + square * speed) * speed**2 * fade
    taken = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1])) * 0.01])
    assert taken[-1] > 0.03 * np.ptp(kinetic)
    np.testing.assert_allclose(energy[0] - energy, taken, atol=2e-4 * taken[-1])


def test_derivatives_of_a_law() -> None:
    sample = random_sample(5, 3)
    plain = sample.model(rods=True)
    model = ruled(sample, plain, (4e3, -6e4, 3e6), (80.0, 200.0), 3.0)
    state, drive = moving(sample, plain, 5), drive_of(31, 0.01, 5)
    block = place.effects_block(model.cables)
    model.physics[block + place.LAW_SATURATION], model.physics[block + place.LAW_UPRIGHT] = 4.0, 0.7
    model.physics[block + place.LAW_ACROSS] = 0.3
    own = {
        block + first + i: step
        for first, count, step in (
            (place.LAW_SPRING, 3, 1.0),
            (place.LAW_BRAKE, 2, 0.1),
            (place.LAW_POINT, 3, 1e-3),
            (place.LAW_DIRECTION, 2, 1e-3),
            (place.LAW_NARROW, 1, 1e-2),
            (place.LAW_SATURATION, 1, 1e-2),
            (place.LAW_UPRIGHT, 1, 1e-2),
            (place.LAW_ACROSS, 1, 1e-2),
        )
        for i in range(count)
    }
    exact = simulate(model, state, drive, directions=np.array(list(own)), substeps=SUBSTEPS)
    assert exact.J is not None
    for k, (entry, step) in enumerate(own.items()):
        numeric = physics_derivative(model, state, drive, entry, step)
        assert_close(exact.J[:, :, k], numeric, str(entry - block), 1e-5)


@pytest.mark.parametrize(
    ("effects", "part"),
    [
        pytest.param(
            {"point_law.spring": (0.0, 0.0, 1.5e7), "point_law.line": (1.2, 0.0)},
            "cubic_stiffness",
            id="cubic_spring",
            marks=pytest.mark.long,
        ),
        pytest.param({"point_law.brake": (0.0, 900.0)}, "quadratic_damping", id="square_brake"),
        pytest.param(
            {"point_law.brake": (300.0, 0.0), "point_law.across": (0.0,), "point_law.line": (1.2, 0.3)},
            "damping",
            id="dashpot",
        ),
    ],
)
def test_a_concealed_law_is_told_by_its_one_part(effects: dict[str, tuple[float, ...]], part: str) -> None:
    """Of a spring's three parts and a brake's two, and its fading, the one that is there stays."""
    effects = {**effects, "point_law.position": (0.2, 0.4, -0.3)}
    spec = replace(shaken(14, 12.0), effects=effects, doubts=False)
    problem, found = seen_by_the_true_body(spec, 3)
    before = misfit(found)
    first = begun(problem, replace(found.point, latents=()))
    assert first is not None
    law = promised_laws(first, ())[0]
    child = children(problem, Standing(first), [], UNLIMITED, lambda label: None, [law])[0]
    # Beside a law another one is not asked for
    assert not any(parts_of(p.candidate) for p in promised_laws(child.rung, child.found))
    (trial,) = sparse(problem, [child.trial(law.candidate)], UNLIMITED)
    assert before > 1.5
    assert misfit(trial.evaluation) < 1.03
    told = trial.candidate.told(estimates(trial.problem, trial.evaluation))
    parts = {name for name in told if "stiffness" in name or "damping" in name}
    assert parts == {part}
    assert "narrow" not in told
    value, std, _ = told[part]
    truth = max(max(v) for n, v in effects.items() if n in ("point_law.spring", "point_law.brake"))
    assert abs(value - truth) < 4.0 * std
    assert std < 0.2 * truth
    fitted = SimpleNamespace(problem=trial.problem, evaluation=trial.evaluation)
    plain = finding(trial, estimates(trial.problem, trial.evaluation), {})
    named = law_finding(fitted, trial.candidate, plain)  # type: ignore[arg-type]
    # A force against the square of speed has a name in the contract; a spring that hardens has none
    assert named.effect == ("air_drag" if part == "quadratic_damping" else "unknown")
    if named.effect == "air_drag":
        assert float(named.parameters["drag_area"]["value"]) == pytest.approx(value / 0.6)  # type: ignore[arg-type]
        assert "drag of the air" in named.statement
