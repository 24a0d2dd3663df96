"""A model that lacks a share of the gyroscopic moment: free fall, energy, derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from test_model_conservation import kinetic_and_potential
from test_model_derivatives import check_physics, drive_of
from test_model_rigs import Sample, moving, random_sample, thesis_case_14

from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import Input, RigModel, State, simulate

Array = NDArray[np.float64]
SPIN = np.array([1.1, -0.7, 0.9])


def lacking(model: RigModel, share: float) -> RigModel:
    """The model without a share of its gyroscopic moment."""
    physics = model.physics.copy()
    physics[place.effects_block(model.cables) + place.GYROSCOPIC_SHARE] = share
    return model.with_physics(physics)


def falling(sample: Sample) -> RigModel:
    """The body with all its cables loose, and long enough to stay so."""
    model = sample.model()
    physics = model.physics.copy()
    for i in range(model.cables):
        physics[layout.cable_offset(i) + layout.LENGTH] += 100.0
    return replace(model.with_physics(physics), modes=np.full(model.cables, layout.SLACK, dtype=np.int64))


def spinning(sample: Sample) -> State:
    """Its centre of mass starts at rest, which the datum beside it does not."""
    R = sample.start.R_world_body
    return State(sample.start.position, R, -R @ np.cross(SPIN, sample.elements[1:4]), SPIN)


@pytest.mark.parametrize("sample", [thesis_case_14(), random_sample(3, 3)], ids=["case_14", "three_cables"])
@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_falling_body_obeys_euler_about_its_centre_of_mass(sample: Sample, share: float) -> None:
    """J alpha = -(1 - s) w x J w: no term of the datum's may be left, and with s = 1 the rate stays."""
    motion = simulate(lacking(falling(sample), share), spinning(sample), Input.none(101, 0.01))
    xx, xy, xz, yy, yz, zz = sample.elements[4:]
    J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    rate = motion.states[:, 9:12]
    alpha = motion.outputs[:, layout.OUT_ANGULAR_ACCELERATION : layout.OUT_ANGULAR_ACCELERATION + 3]
    left = alpha @ J + (1.0 - share) * np.cross(rate, rate @ J)
    assert np.max(np.abs(left)) < 1e-9 * np.max(np.abs(np.cross(rate, rate @ J)))
    if share == 1.0:
        np.testing.assert_allclose(rate, np.tile(SPIN, (101, 1)), rtol=0.0, atol=1e-12)
    else:
        assert np.max(np.abs(rate - SPIN)) > 0.1
    center = motion.states[:, :3] + motion.R_world_body @ sample.elements[1:4]
    time = 0.01 * np.arange(101)
    fallen = center[0, 2] - 0.5 * sample.rig.gravity * time**2
    np.testing.assert_allclose(center[:, 2], fallen, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(center[:, :2], np.tile(center[0, :2], (101, 1)), rtol=0.0, atol=1e-9)


def test_a_gyroscopic_moment_does_no_work_there_or_not() -> None:
    sample = thesis_case_14()
    full, none = (lacking(sample.model(rods=True), share) for share in (0.0, 1.0))
    drive = Input.none(1001, 0.01)
    seen = {}
    for name, model in (("full", full), ("none", none)):
        motion = simulate(model, sample.start, drive, substeps=8)
        kinetic, potential = kinetic_and_potential(model, motion)
        assert np.ptp(kinetic + potential) < 1e-6 * np.ptp(kinetic)
        seen[name] = motion
    assert np.max(np.abs(seen["full"].states[:, :3] - seen["none"].states[:, :3])) > 1e-3


@pytest.mark.parametrize("share", [0.0, 1.0])
@pytest.mark.parametrize("sample", [thesis_case_14(), random_sample(5, 3)], ids=["four", "three"])
def test_derivatives_in_the_body_and_in_the_share(sample: Sample, share: float) -> None:
    """The body's ten numbers stand in the effect, so that their derivatives must pass through it."""
    model = lacking(sample.model(rods=True), share)
    block = place.effects_block(model.cables)
    entries = [*range(layout.INERTIAL, layout.INERTIAL + 10), block + place.GYROSCOPIC_SHARE]
    entries += [layout.GRAVITY, layout.EXCITER_POSITION, layout.cable_offset(1) + layout.LENGTH]
    check_physics(model, moving(sample, model, 5), drive_of(61, 0.01, 5), entries, 1e-6)
