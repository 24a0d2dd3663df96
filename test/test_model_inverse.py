"""A model that changes moves as before under the wrench that inverse dynamics tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_model_rigs import random_sample

from rig_identification.model.effects import place
from rig_identification.model.inverse import kept_in_motion
from rig_identification.model.motion import Input, RigModel, State, simulate


def moved(seed: int, cables: int) -> tuple[RigModel, Input, State]:
    sample = random_sample(seed, cables)
    model = sample.model(rods=True)
    drive = Input.none(200, 0.01)
    time = drive.step * np.arange(200)
    wrench = np.stack([30.0 * np.sin(2.0 * time + k) for k in range(6)], axis=1)
    return model, replace(drive, wrench=wrench), sample.start


@pytest.mark.parametrize("cables", [2, 3, 4])
def test_the_same_model_needs_the_same_wrench(cables: int) -> None:
    model, drive, start = moved(50 + cables, cables)
    motion = simulate(model, start, drive)
    kept = kept_in_motion(model, motion, drive, model)
    np.testing.assert_allclose(kept, drive.wrench, atol=1e-8)


@pytest.mark.parametrize("cables", [2, 3, 4])
def test_a_model_with_rubbing_hinges_moves_as_the_one_without(cables: int) -> None:
    model, drive, start = moved(60 + cables, cables)
    motion = simulate(model, start, drive)
    physics = model.physics.copy()
    block = place.effects_block(model.cables)
    physics[block + place.FRICTION] = 2.0
    physics[block + place.CREEP] = 0.05
    rubbing = model.with_physics(physics)
    kept = kept_in_motion(model, motion, drive, rubbing)
    alike = simulate(rubbing, start, replace(drive, wrench=kept))
    unlike = simulate(rubbing, start, drive)
    size = np.max(np.abs(motion.states - unlike.states))
    assert np.max(np.abs(motion.states - alike.states)) < 0.05 * size
