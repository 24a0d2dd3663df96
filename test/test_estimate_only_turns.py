"""What is believed, and how noisy samples are, where nothing but a body's turning is measured, and seldom."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from session_samples import make_rig
from test_model_rigs import bifilar, trifilar

from rig_identification.estimate.evidence import Run, prepare
from rig_identification.estimate.hung_by_eye import BESIDE, beside_middle, hung_by_eye, note_of, only_turns
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.noise import noise_std
from rig_identification.estimate.prediction import start_basis
from rig_identification.estimate.swing_period import SWINGS, beside_a_swing, long_enough, swing_period
from rig_identification.estimate.unseen_swing import swing_belief, swing_std
from rig_identification.model.motion import on_cables
from rig_identification.recording import Recording, Series, Session
from rig_identification.rig import Mount, Rig

RATE, SECONDS, PERIOD = 15.0, 40.0, 2.5
TIME = np.arange(round(RATE * SECONDS)) / RATE
UPRIGHT = Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def swing(noise: float) -> np.ndarray:
    """A turn that dies away, and what reads it."""
    turn = 0.1 * np.exp(-0.01 * TIME) * np.cos(2.0 * np.pi * TIME / PERIOD)
    return turn + noise * np.random.default_rng(2).normal(size=TIME.size)


def session(rig: Rig, **others: Series) -> Session:
    """A gyroscope that tells one rate alone, and ``others``."""
    rate = np.full((TIME.size, 6), np.nan)
    rate[:, 2] = 2.0 * np.pi / PERIOD * swing(1e-3)
    run = Recording("run_1", "dynamic", False, 0, SECONDS, imu=Series(TIME, rate), **others)
    return Session("turns", replace(rig, imu=UPRIGHT, noise={}), (run,))


def run_of(one: Session) -> Run:
    return prepare(one.rig, one.recordings[0])


def test_a_piece_is_as_long_as_a_swing_and_a_half_where_only_motion_is_measured() -> None:
    run = run_of(session(bifilar().rig))
    assert swing_period(run) == pytest.approx(PERIOD, rel=0.05)
    assert long_enough(run, 1.0) == pytest.approx(SWINGS * PERIOD, rel=0.05)
    assert long_enough(run, 20.0) == 20.0
    short = run.until(3.0)
    assert long_enough(short, 1.0) <= short.grid.duration
    angles = Series(TIME, np.stack([swing(1e-3), swing(1e-3)], axis=1))
    tension = Series(TIME, 1000.0 + swing(1e-3)[:, None])
    weighed = session(bifilar().rig, inclination=angles)
    weighed = replace(
        weighed, recordings=(replace(weighed.recordings[0], tension={weighed.rig.cables[0].name: tension}),)
    )
    assert long_enough(run_of(weighed), 1.0) == 1.0


@pytest.mark.parametrize("noise", [1e-4, 3e-3])
def test_what_no_swing_follows_is_noise(noise: float) -> None:
    assert beside_a_swing(TIME, swing(noise)[:, None], PERIOD)[0] == pytest.approx(noise, rel=0.2)
    # A spectrum of a few swings has its line some per cent beside the swing's
    assert beside_a_swing(TIME, swing(noise)[:, None], 1.02 * PERIOD)[0] == pytest.approx(noise, rel=0.2)


def test_what_a_device_may_read_beside_a_swing_is_no_noise_of_its_samples() -> None:
    lines = np.stack([np.cos(4.1 * TIME), np.sin(4.1 * TIME)], axis=1)
    read = (swing(1e-3) + lines @ [0.004, -0.003])[:, None]
    assert beside_a_swing(TIME, read, PERIOD)[0] > 2.0e-3
    assert beside_a_swing(TIME, read, PERIOD, lines)[0] == pytest.approx(1e-3, rel=0.15)


@pytest.mark.parametrize("noise", [1e-4, 3e-3])
def test_a_slow_tracker_is_no_noisier_for_its_swing(noise: float) -> None:
    """A cubic through seven samples, a fifth of a period, would take the swing for noise."""
    values = swing(noise)[:, None]
    std, estimated = noise_std(replace(make_rig(), noise={}), "mocap_orientation", TIME, values)
    assert estimated
    assert std[0] == pytest.approx(noise, rel=0.25)
    # Across a picture that is missing differences tell of motion
    gap = np.arange(TIME.size) != 200
    less, _ = noise_std(replace(make_rig(), noise={}), "mocap_orientation", TIME[gap], values[gap])
    assert less[0] == pytest.approx(noise, rel=0.25)


def test_only_turns_leave_the_centre_to_belief() -> None:
    turns = session(bifilar().rig)
    problem = pose_problem(turns)[0]
    assert only_turns(problem.runs, problem.rests)
    assert problem.taken
    assert problem.bench.unseen
    assert problem.weak[list(problem.taken)].tolist() == [pytest.approx(1.2 * BESIDE)] * 2
    assert "is taken to hang there to within 0.055 m" in note_of(problem)[0]
    # Who measures specific force as well asks for no belief
    first = turns.recordings[0]
    assert first.imu is not None
    values = first.imu.values.copy()
    values[:, 3:] = np.random.default_rng(1).normal(size=(TIME.size, 3))
    felt = replace(turns, recordings=(replace(first, imu=Series(TIME, values)),))
    told = pose_problem(felt)[0]
    assert not told.taken
    assert not told.bench.unseen
    assert note_of(told) == ()
    assert hung_by_eye(told) is told


@pytest.mark.parametrize(("sample", "ways"), [(bifilar(), 1), (trifilar(), 2)])
def test_how_far_inertia_is_off_beside_the_middle(sample, ways: int) -> None:  # type: ignore[no-untyped-def]
    """J falls by e^2 / r^2: the root mean square of that over centres of mass drawn from the belief."""
    problem = pose_problem(session(sample.rig))[0]
    std = beside_middle(problem, sample.elements)
    assert np.flatnonzero(std).tolist() == [9]
    radius = 0.6 if ways == 1 else 0.9
    drawn = problem.weak[problem.taken[0]] * np.random.default_rng(3).normal(size=(200_000, ways))
    share = np.sum(drawn**2, axis=1) / radius**2
    assert std[9] / sample.elements[9] == pytest.approx(float(np.sqrt(np.mean(share**2))), rel=0.05)


def test_a_body_is_believed_to_hardly_swing() -> None:
    sample = bifilar()
    model = sample.model()
    turned = replace(sample.start, R_world_body=Rotation.from_rotvec([0.01, 0.0, 0.15]).as_matrix())
    start = on_cables(model, replace(turned, position=sample.start.position + np.array([0.03, -0.02, 0.0])))
    basis = start_basis(model, start)
    cost, information, gradient = swing_belief(sample.rig, start, basis)
    step = 1e-3 * np.random.default_rng(4).normal(size=basis.shape[1])
    ahead, behind = (
        swing_belief(sample.rig, on_cables(model, start.moved(sign * basis @ step)), basis)[0]
        for sign in (1.0, -1.0)
    )
    assert -(ahead - behind) / 2.0 == pytest.approx(float(gradient @ step), rel=0.05)
    assert cost > 0.0
    assert np.all(np.linalg.eigvalsh(information) > -1e-12)
    # Three degrees on cables of 1.5 m
    assert swing_std(sample.rig)[:4] == pytest.approx([0.075, 0.075, 0.05, 0.05])
    # Turning itself is measured, and nothing is believed of it
    still = replace(start, R_world_body=Rotation.from_rotvec([0.0, 0.0, 0.15]).as_matrix())
    assert swing_belief(sample.rig, replace(still, position=sample.start.position), basis)[0] < 1e-6
