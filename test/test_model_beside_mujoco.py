"""The forward model beside MuJoCo, the same true numbers in both: where a ceiling rings they move alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation

pytest.importorskip("mujoco", reason="MuJoCo is missing: THE MODEL IS NOT SET BESIDE IT (pip install mujoco)")

from test_model_rigs import elements_of

from bench.concealed.draw import draw_scene
from bench.concealed.effects.ceiling_compliance import CeilingCompliance
from bench.concealed.engine import Engine
from bench.concealed.scene import Scene
from rig_identification.live.plant_effects import YieldingCeiling
from rig_identification.model import layout
from rig_identification.model.motion import Input, RigModel, State, on_cables, rig_model, simulate

AXIS, STIFFNESS, SHARE, DAMPING_RATIO = 0, 2e7, 0.3, 0.01


def true_model(scene: Scene) -> RigModel:
    """The model with the numbers that the engine has, instead of those that a lab describes."""
    body = scene.body
    model = rig_model(scene.rig, elements_of(body.mass, body.center_of_mass, body.inertia))
    physics = model.physics.copy()
    geometry = scene.geometry
    for i, (top, hinge, length) in enumerate(
        zip(geometry.ceiling, geometry.hinge, geometry.length, strict=True)
    ):
        o = layout.cable_offset(i)
        physics[o + layout.CEILING_POINT :][:3] = top
        physics[o + layout.BODY_POINT :][:3] = hinge
        physics[o + layout.LENGTH] = length
    physics[layout.EXCITER_POSITION :][:3] = scene.devices.exciter_position
    return replace(
        model.with_physics(physics),
        exciter_orientation=np.ascontiguousarray(scene.devices.exciter_rotation),
    )


def test_a_body_under_a_ceiling_that_rings_moves_as_mujoco_has_it() -> None:
    scene = draw_scene(1, 2.0)
    mass = SHARE * scene.body.mass
    ceiling = CeilingCompliance(AXIS, STIFFNESS, mass, DAMPING_RATIO)
    plan = next(p for p in scene.plans if p.name == "run_1")
    engine = Engine(scene, [ceiling], plan)
    assert engine.release() < 1e-4
    plate = float(engine.data.qpos[7])
    path = engine.run(2.0)
    stiffness = np.where(np.arange(3) == AXIS, STIFFNESS, 0.0)
    model = true_model(scene).with_internal(YieldingCeiling(stiffness, mass, DAMPING_RATIO).blocks())
    R = Rotation.from_quat(path.quaternion[0]).as_matrix()
    start = State(path.position[0], R, path.velocity[0], path.rate[0], np.array([plate, 0.0]))
    step = float(path.time[1] - path.time[0])
    force_rate = np.gradient(path.force, step, axis=0)
    drive = Input(step, path.force, force_rate, np.zeros((path.force.shape[0], 6)))
    motion = simulate(model, on_cables(model, start), drive, substeps=1)
    tension = motion.outputs[:, layout.OUT_TENSION :][:, : path.tension.shape[1]]
    assert np.max(np.abs(motion.outputs[:, :3] - path.position)) < 1e-6
    # What a cell reports has to be what acted, whatever rings: a part in two thousand of it
    ours, its = (t - savgol_filter(t, 101, 3, axis=0) for t in (tension, path.tension))
    assert np.min(np.std(its, axis=0)) > 1.0
    np.testing.assert_allclose(np.sum(ours * its, axis=0) / np.sum(ours**2, axis=0), 1.0, atol=5e-4)
