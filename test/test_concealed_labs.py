"""Rigs and effects of the world of labs: what they promise of size, form and physics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("mujoco", reason="MuJoCo is missing: the world of labs is not tested")

from bench.concealed.draw import draw_scene
from bench.concealed.effects import CATALOGUE
from bench.concealed.effects.base import State
from bench.concealed.effects.cable_elasticity import CableElasticity
from bench.concealed.effects.hose import Hose
from bench.concealed.effects.sprung_car import SprungCar
from bench.concealed.engine import Engine
from bench.concealed.generate import make_session
from bench.concealed.inertia import about_origin, is_body
from bench.concealed.labs import DETERMINATE, INDETERMINATE, draw_lab_scene
from bench.concealed.scene import Array
from bench.concealed.seal import compose

LARGEST = {  # what labs have at most, by parameter; the least where less is more of it
    "cable_elasticity": ("axial_stiffness", 5e5),
    "cable_mass": ("linear_density", 2.0),
    "ceiling_compliance": ("stiffness", 3e5),
    "exciter_rotor": ("rotor_mass", 30.0),
    "hinge_damping": ("damping", 50.0),
    "hinge_friction": ("torque", 20.0),
    "air_added_mass": ("added_mass", 30.0),
    "liquid_slosh": ("mass", 100.0),
    "tether": ("stiffness", 500.0),
}


def test_the_first_world_draws_what_it_always_drew() -> None:
    """Sealed runs are repeated from their seeds: these figures may not change."""
    scene = draw_scene(1, 30.0)
    assert scene.geometry_name == "case_14"
    np.testing.assert_allclose(scene.body.mass, 1090.9394400546423, rtol=1e-12)
    np.testing.assert_allclose(scene.rig.cables[2].length, 2.5065264, rtol=1e-12)
    plan = scene.plans[3]
    assert plan.motor is not None
    np.testing.assert_allclose(plan.motor.wobble_period, 20.422105925532517, rtol=1e-12)


@pytest.mark.parametrize("name", [*DETERMINATE, *INDETERMINATE])
def test_every_rig_can_be_built_and_is_described_within_tolerances(name: str) -> None:
    scene = draw_lab_scene(3, 20.0, name=name, stiffness=2e6)
    assert is_body(scene.body)
    geometry, tolerance = scene.geometry, scene.rig.tolerance
    assert len(scene.rig.cables) == len(geometry.length) == len(scene.errors.tension_gain)
    for cable, hinge, length in zip(scene.rig.cables, geometry.hinge, geometry.length, strict=True):
        assert abs(cable.length - length) < 3.1 * tolerance["cable_length"]
        assert np.abs(cable.body_point - hinge).max() < 3.1 * tolerance["hinge_position"]


def test_rigs_have_two_to_eight_cables() -> None:
    counts = {
        len(draw_lab_scene(3, 20.0, name=name, stiffness=2e6).geometry.length)
        for name in (*DETERMINATE, *INDETERMINATE)
    }
    assert counts == set(range(2, 9))


def test_many_parallel_cables_share_the_weight_as_they_stretch() -> None:
    scene = draw_lab_scene(4, 5.0, name="parallel_7", stiffness=1e6)
    engine = Engine(scene, [CableElasticity(1e6, 0.02)], scene.plans[0])
    assert engine.release() < 1e-6
    path = engine.stand()
    weight = scene.body.mass * scene.rig.gravity
    # All upright to a few milliradians
    assert path.tension[0].sum() == pytest.approx(weight, rel=1e-4)
    assert path.tension.min() > 0.3 * weight / 7.0
    expected = path.tension[0] * scene.geometry.length / 1e6
    np.testing.assert_allclose(path.stretch[0], expected, rtol=1e-6)


def test_an_indeterminate_rig_is_refused_without_cables_that_stretch() -> None:
    with pytest.raises(ValueError, match="give cable_elasticity"):
        draw_lab_scene(3, 20.0, name="parallel_6", stiffness=None)


@pytest.mark.parametrize("name", sorted(LARGEST))
def test_the_strong_end_is_the_labs(name: str) -> None:
    scene = draw_lab_scene(3, 20.0, name="van", stiffness=None)
    parameter, most = LARGEST[name]
    strong = CATALOGUE[name].draw_lab(np.random.default_rng(2), scene, 1.0)
    assert strong.truth()["parameters"][parameter]["value"] == pytest.approx(most)


def _state(position: Array, velocity: Array) -> State:
    return State("run_1", 1.0, position, np.eye(3), velocity, np.zeros(3))


def test_a_hose_pulls_by_stretch_and_rate_and_never_pushes() -> None:
    place = np.array([0.5, 0.2, -0.3])
    home = place - np.array([0.0, 0.0, 2.0])
    hose = Hose(200.0, 5.0, 20.0, place, home + np.array([3.0, 0.0, 0.0]), home)
    assert hose.length == pytest.approx(3.0 - 20.0 / 200.0)
    still = np.zeros(3)
    at_home = hose.force(_state(np.array([0.0, 0.0, -2.0]), still))
    np.testing.assert_allclose(at_home, [20.0, 0.0, 0.0, *np.cross(place, [20.0, 0.0, 0.0])], atol=1e-12)
    away = hose.force(_state(np.array([-0.05, 0.0, -2.0]), np.array([-0.4, 0.0, 0.0])))
    assert away[0] == pytest.approx(20.0 + 200.0 * 0.05 + 5.0 * 0.4)
    assert not hose.force(_state(np.array([0.2, 0.0, -2.0]), np.array([-3.0, 0.0, 0.0]))).any()
    # It comes in faster than it can pull: it would have to push
    assert not hose.force(_state(np.array([0.09, 0.0, -2.0]), np.array([9.0, 0.0, 0.0]))).any()


def test_a_hose_can_go_in_any_direction() -> None:
    scene = draw_lab_scene(3, 20.0, name="van", stiffness=None)
    drawn = [Hose.draw(np.random.default_rng(k), scene, 0.5).truth()["where"] for k in range(200)]
    direction = np.array([where["direction"] for where in drawn])
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1.0)
    assert np.abs(direction.mean(axis=0)).max() < 4.0 / np.sqrt(3.0 * 200.0)
    np.testing.assert_allclose(direction.T @ direction / 200.0, np.eye(3) / 3.0, atol=0.12)


@pytest.mark.parametrize("seed", range(12))
def test_a_sprung_car_leaves_a_body_and_both_make_the_whole(seed: int) -> None:
    scene = draw_lab_scene(seed, 20.0, name=None, stiffness=None)
    car = SprungCar.draw(np.random.default_rng(seed), scene, 1.0)
    assert car.mass == pytest.approx(scene.body.mass / 3.0)
    assert car.frequency.min() >= 1.2
    assert car.frequency.max() <= 6.0
    rest = car.rigid_part(scene.body)
    assert is_body(rest)
    assert np.sum(car.inertia) >= 2.0 * np.max(car.inertia)
    part = np.diag(car.inertia) + car.mass * (
        car.position @ car.position * np.eye(3) - np.outer(car.position, car.position)
    )
    np.testing.assert_allclose(about_origin(rest) + part, about_origin(scene.body), rtol=1e-9, atol=1e-7)


def test_a_sprung_car_hangs_where_it_is_said_to_be() -> None:
    scene = draw_lab_scene(6, 5.0, name="case_10", stiffness=None)
    car = SprungCar.draw(np.random.default_rng(1), scene, 1.0)
    frozen, loose = Engine(scene, [], scene.plans[0]), Engine(scene, [car], scene.plans[0])
    assert max(frozen.release(), loose.release()) < 1e-6
    fixed, sprung = frozen.stand(), loose.stand()
    tilt = Rotation.from_quat(fixed.quaternion[0]).magnitude()
    # Springs give way to a tilt by g sin(tilt) / w^2 and take the weight along
    most = car.mass * 9.81 * tilt * 9.81 / (2.0 * np.pi * car.frequency.min()) ** 2
    assert np.abs(sprung.tension[0] - fixed.tension[0]).max() < 10.0 * most + 1.0


def test_fields_can_be_given_and_the_session_says_what_moved_it() -> None:
    _, truth = make_session(
        7, kind="hinge_damping", world="labs", rig="bifilar", given={"damping": 12.5}, duration=1.5
    )
    assert truth["effects"][0]["parameters"]["damping"]["value"] == 12.5
    assert (truth["world"], truth["engine"], truth["rig_desc"]) == ("labs", "mujoco", "bifilar")
    assert len(truth["true_rig"]["lengths"]) == 2


def test_the_second_engine_refuses_by_name_what_it_has_not() -> None:
    with pytest.raises(ValueError, match="the second engine has no loose_mass"):
        make_session(7, kind="loose_mass", world="labs", engine="exudyn", duration=1.5)


def test_a_third_of_a_sealing_of_labs_is_the_second_engines() -> None:
    entries, first = compose(range(300), "salt", "labs"), compose(range(300), "salt")
    assert sum(e["engine"] == "exudyn" for e in entries) == 100
    assert [(e["kind"], e["size"]) for e in entries] == [(e["kind"], e["size"]) for e in first]
    assert not any(e["engine"] == "exudyn" and "cable_slack" in e["kind"] for e in entries)
