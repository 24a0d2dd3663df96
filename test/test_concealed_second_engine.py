"""Exudyn's motion against MuJoCo's and against laws that neither uses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

pytest.importorskip("mujoco", reason="MuJoCo is missing: the second engine has nothing to be compared with")
pytest.importorskip(
    "exudyn", reason="Exudyn is missing: THE SECOND ENGINE IS NOT TESTED (pip install exudyn)"
)

from bench.concealed.effects.air_added_mass import AirAddedMass
from bench.concealed.effects.base import Effect
from bench.concealed.effects.cable_elasticity import CableElasticity
from bench.concealed.effects.cable_mass import CableMass
from bench.concealed.effects.ceiling_compliance import CeilingCompliance
from bench.concealed.effects.exciter_rotor import ExciterRotor
from bench.concealed.effects.hinge_damping import HingeDamping
from bench.concealed.effects.hose import Hose
from bench.concealed.effects.liquid_slosh import LiquidSlosh
from bench.concealed.effects.place import released_aside
from bench.concealed.effects.sprung_car import SprungCar
from bench.concealed.engine import Engine
from bench.concealed.labs import draw_lab_scene
from bench.concealed.scene import Scene
from bench.concealed.second_engine import SecondEngine
from bench.concealed.signals import Trajectory

SECONDS = 2.5
SETTLED = 60  # rows of 1 ms: MuJoCo's rods and cables take as long to settle after the release
STIFFNESS = 1e6  # N


def _effects(scene: Scene, name: str) -> list[Effect]:
    center = scene.body.center_of_mass
    place = center + np.array([0.3, -0.2, 0.1])
    home = np.array([0.0, 0.0, -2.0]) + place
    made: dict[str, list[Effect]] = {
        "clean": [],
        "hose": [Hose(300.0, 8.0, 40.0, place, home + np.array([1.5, 0.8, 0.3]), home)],
        "sprung": [
            SprungCar(0.2 * scene.body.mass, np.array([3.0, 2.5, 2.0]), 0.06, place, np.full(3, 25.0))
        ],
        "elastic": [CableElasticity(STIFFNESS, 0.02)],
        "ceiling": [CeilingCompliance(0, 6e5, 80.0, 0.03)],
        "damping": [HingeDamping(50.0)],
        "rotor": [ExciterRotor(10.0, scene.devices.exciter_position)],
        "air": [AirAddedMass(15.0)],
        "liquid": [LiquidSlosh(40.0, 0.9, 0.02, place)],
        "heavy cables": [CableMass(1.0)],
    }
    return made[name]


def _scene(rig: str) -> Scene:
    return released_aside(draw_lab_scene(5, SECONDS, name=rig, stiffness=STIFFNESS))


def _moved(engine: type[Any], scene: Scene, effects: list[Effect]) -> Trajectory:
    made = engine(scene, effects, next(p for p in scene.plans if p.name == "run_1"))
    assert made.release() < 1e-6
    return made.run(SECONDS)


@pytest.mark.parametrize(
    ("rig", "name"),
    [
        ("case_12", "clean"),
        ("bifilar", "clean"),
        ("splayed_5", "clean"),
        ("case_12", "hose"),
        ("case_12", "sprung"),
        ("parallel_6", "elastic"),
        ("case_12", "ceiling"),
        ("trifilar", "damping"),
        ("case_12", "rotor"),
        ("case_12", "air"),
        ("case_12", "liquid"),
        ("case_12", "heavy cables"),
    ],
)
def test_both_engines_move_alike(rig: str, name: str) -> None:
    """Apart by a tenth of one sample's noise at most."""
    scene = _scene(rig)
    effects = _effects(scene, name)
    one, other = (_moved(engine, scene, effects) for engine in (Engine, SecondEngine))
    # Of the last two rows MuJoCo reports what acted at the start of a step
    after, noise = slice(SETTLED, -2), scene.rig.noise
    assert np.abs(other.tension - one.tension)[after].max() < 0.1 * noise["tension"]
    assert np.abs(other.rate - one.rate)[after].max() < 0.1 * noise["angular_rate"]
    assert np.abs(other.acceleration - one.acceleration)[after].max() < 0.1 * noise["specific_force"]
    assert np.ptp(one.position, axis=0).max() > 0.003
    # The shaft's angle is summed up at other steps
    np.testing.assert_allclose(other.shaft, one.shaft, atol=1e-5)
    np.testing.assert_allclose(other.force, one.force, atol=0.01 * noise["exciter_force"])


@pytest.mark.parametrize("rig", ["case_12", "bifilar"])
def test_energy_changes_by_the_work_of_the_exciter_alone(rig: str) -> None:
    scene = _scene(rig)
    path, body = _moved(SecondEngine, scene, []), scene.body
    rotation = Rotation.from_quat(path.quaternion).as_matrix()
    center = path.position + rotation @ body.center_of_mass
    velocity = path.velocity + np.einsum("nij,nj->ni", rotation, np.cross(path.rate, body.center_of_mass))
    kinetic = 0.5 * body.mass * (velocity**2).sum(1)
    kinetic += 0.5 * np.einsum("ni,ij,nj->n", path.rate, body.inertia, path.rate)
    energy = kinetic + body.mass * scene.rig.gravity * center[:, 2]
    force = np.einsum("nij,nj->ni", rotation, path.force @ scene.devices.exciter_rotation.T)
    point = np.cross(path.rate, scene.devices.exciter_position)
    power = (force * (path.velocity + np.einsum("nij,nj->ni", rotation, point))).sum(1)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(path.time))])
    assert np.abs(energy - energy[0] - work).max() < 1e-5 * kinetic.max()
    assert np.abs(path.stretch).max() < 1e-8


def test_newton_holds_with_the_tensions_that_it_reports() -> None:
    scene = _scene("case_12")
    path, body = _moved(SecondEngine, scene, []), scene.body
    rotation = Rotation.from_quat(path.quaternion).as_matrix()
    arm = body.center_of_mass
    turning = np.cross(path.rate_change, arm) + np.cross(path.rate, np.cross(path.rate, arm))
    taken = body.mass * (path.acceleration + np.einsum("nij,nj->ni", rotation, turning))
    force = np.einsum("nij,nj->ni", rotation, path.force @ scene.devices.exciter_rotation.T)
    force[:, 2] -= body.mass * scene.rig.gravity
    for top, hinge, tension in zip(scene.geometry.ceiling, scene.geometry.hinge, path.tension.T, strict=True):
        up = top - path.position - rotation @ hinge
        force += tension[:, None] * up / np.linalg.norm(up, axis=1, keepdims=True)
    # The first row is the start's own solution, the second the only one that the trapezoidal rule shakes
    assert np.abs(force - taken)[2:].max() < 1e-5 * body.mass * scene.rig.gravity


def test_many_stiff_cables_come_to_rest() -> None:
    stiff = 4e7  # N
    scene = draw_lab_scene(90002, SECONDS, name="parallel_8", stiffness=stiff)
    for plan in scene.plans[:2]:
        engine = SecondEngine(scene, [CableElasticity(stiff, 0.02)], plan)
        assert engine.release() < 1e-6
        pulled = engine.stand().tension[0]
        carried = (scene.body.mass + plan.dummy_mass) * scene.rig.gravity
        assert pulled.sum() == pytest.approx(carried, rel=1e-4)


def test_it_refuses_by_name_what_it_has_not() -> None:
    from bench.concealed.effects.cable_slack import CableSlack

    scene = _scene("case_12")
    with pytest.raises(ValueError, match="the second engine has no cable_slack"):
        SecondEngine(scene, [CableSlack(1.2)], scene.plans[2])
