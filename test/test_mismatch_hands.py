"""What is told of the part of a watched run in which a person drives the body."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import prepare
from rig_identification.estimate.fitted import HeldPart
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.segments import pieces_of
from rig_identification.estimate.swing_period import long_enough
from rig_identification.mismatch.hands import hand_finding
from rig_identification.recording import Recording, Series, Session
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Rig

LENGTH, MASS, GRAVITY = 1.5, 1.1, 9.80665
TIME = np.arange(3000) / 100.0
#: Seconds in which a hand pushes with PUSH N.
HELD, PUSH = (4.0, 10.0), 0.8


def rig() -> Rig:
    cables = tuple(
        Cable(f"cable_{i + 1}", np.array([x, 0.0, 0.0]), np.array([x, 0.0, 0.0]), LENGTH)
        for i, x in enumerate((-0.25, 0.25))
    )
    return Rig(GRAVITY, cables, MASS, 0.002, tolerance=dict(DEFAULT_TOLERANCE))


def swung(push: float) -> Recording:
    """A pendulum that is pushed to and fro between two times, as a tracker sees it."""
    rate, step = np.sqrt(GRAVITY / LENGTH), TIME[1]
    x, v, path = 0.02, 0.0, []
    for t in TIME:
        pushed = HELD[0] < t < HELD[1]
        v += step * (push / MASS * np.sin(1.7 * rate * t) * pushed - rate**2 * x)
        x += step * v
        path.append(x)
    noise = np.random.default_rng(1).normal(0.0, 1e-5, (TIME.size, 3))
    place = noise + np.stack([path, np.zeros(TIME.size), np.full(TIME.size, -LENGTH)], axis=1)
    upright = np.tile(Rotation.identity().as_quat(), (TIME.size, 1))
    values = np.concatenate([place, upright], axis=1)
    return Recording("run_1", "dynamic", False, 0, float(TIME[-1]), mocap=Series(TIME, values))


def fitted(recording: Recording) -> Any:
    """As much of a fit as the hand's force asks for: the rig, the body, and the part that was cut off."""
    problem, theta, _ = pose_problem(Session("pushed", rig(), (recording,)))
    evaluation = SimpleNamespace(point=SimpleNamespace(theta=theta))
    held = (HeldPart("run_1", *HELD),)
    return SimpleNamespace(problem=problem, evaluation=evaluation, holdout_runs=(), lost=(), held_parts=held)


def test_a_hand_is_told_with_its_force() -> None:
    found = hand_finding(fitted(swung(PUSH)))
    assert found is not None
    assert found.parameters["peak_force"]["value"] == pytest.approx(PUSH, rel=0.2)


def test_a_hand_that_pushes_no_harder_than_the_free_part_shows_is_no_finding() -> None:
    assert hand_finding(fitted(swung(0.0))) is None


def test_where_no_place_is_measured_no_force_is_told() -> None:
    recording = swung(PUSH)
    assert recording.mocap is not None
    turns = recording.mocap.values.copy()
    turns[:, :3] = np.nan
    turns[:, 5] = 0.1 * np.sin(TIME)
    turns[:, 6] = np.cos(np.arcsin(turns[:, 5]))
    assert hand_finding(fitted(replace(recording, mocap=Series(TIME, turns)))) is None


def test_pieces_that_are_told_apart_begin_at_one_phase() -> None:
    run = prepare(rig(), swung(0.0))
    period = 2.0 * np.pi * np.sqrt(LENGTH / GRAVITY)
    length = long_enough(run, 2.0, swings=1.0)
    assert length == pytest.approx(period, rel=0.03)
    ends = np.array([piece.offset for piece in pieces_of(run, length)])
    assert np.ptp(ends / period - np.round(ends / period)) < 0.3
