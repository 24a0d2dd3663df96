"""A gyroscope's bias that wanders within a run is integrated out of it where one rate is all there is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_estimate_only_turns import PERIOD, SECONDS, run_of, session
from test_model_rigs import bifilar

from rig_identification.estimate.unseen import read_beside
from rig_identification.estimate.unseen_sway import without_sway
from rig_identification.estimate.wandering_bias import CAMERA, INSTABILITY, wander_shapes

RUN = run_of(session(bifilar().rig))
RATE = next(c for c in RUN.channels if c.quantity == "angular_rate")


def test_the_shapes_are_slower_than_half_the_turn_and_have_the_power_of_flicker_noise() -> None:
    shapes = wander_shapes(RUN, RATE)
    nodes = RUN.grid.step * np.arange(RUN.grid.nodes)
    fastest = shapes.shape[1] / (2.0 * RUN.grid.duration)
    assert fastest <= 0.5 / PERIOD * 1.05
    assert fastest > 0.4 / PERIOD
    # One octave of flicker noise of instability B holds B^2 ln 2 / (2 pi), whichever octave it is
    power = np.mean(shapes**2, axis=0)
    for first in (2, 4):
        octave = float(np.sum(power[first - 1 : 2 * first - 1]))
        exact = INSTABILITY**2 / (2.0 * np.pi) * sum(1.0 / k for k in range(first, 2 * first))
        assert octave == pytest.approx(exact, rel=0.05)
    assert nodes.size == shapes.shape[0]


def test_a_cameras_angle_wanders_by_a_share_of_a_pixel() -> None:
    shapes = wander_shapes(RUN, RATE)
    angles = wander_shapes(RUN, replace(RATE, quantity="orientation"))
    assert angles == pytest.approx(CAMERA / INSTABILITY * shapes)


def test_a_slow_bias_weighs_little_and_the_turn_as_much_as_before() -> None:
    shapes = wander_shapes(RUN, RATE)
    read = read_beside(bifilar().rig, RUN, RATE)
    assert read is not None
    assert np.array_equal(read[:, -shapes.shape[1] :], shapes)
    noise = 1e-3 * np.sqrt(RUN.grid.step)
    nodes = RUN.grid.step * np.arange(RUN.grid.nodes)
    slow = INSTABILITY * np.cos(np.pi * nodes / SECONDS)
    turn = INSTABILITY * np.cos(2.0 * np.pi * nodes / PERIOD)
    columns = np.stack([slow, turn], axis=1) / noise
    before = np.linalg.norm(columns, axis=0)
    without_sway(shapes / noise, columns)
    share = np.linalg.norm(columns, axis=0) / before
    assert share[0] < 0.5
    assert share[1] > 0.9
