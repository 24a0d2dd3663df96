"""A tracker's error that goes with the pose: its shapes, how it is integrated out, and what is told of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.estimate.evidence import prepare
from rig_identification.estimate.identify import compose, fit_session, judged
from rig_identification.estimate.pose_error import KNOTS, turning_of
from rig_identification.estimate.pose_error_told import pose_errors
from rig_identification.estimate.segments import with_noise_of_swing
from rig_identification.recording import Recording, Series, Session
from rig_identification.result import ELEMENTS, Identification
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Rig
from rig_identification.simulate import Posed, RunSpec, SampleRates, SessionSpec, simulate_session

KEY = ("mocap", "orientation", (3, 4, 5))
BODY = np.array([1.1, 0.01, 0.0, -0.08, 0.05, 0.0, 0.0, 0.04, 0.0, 0.075])
#: m and rad that the pose jumps by where the body has turned beyond HIDDEN (rad): a marker goes behind it.
JUMP, HIDDEN = np.array([0.0024, 0.0, 0.001, 0.0, -0.01, 0.01]), 0.12


def rig() -> Rig:
    cables = tuple(
        Cable(f"cable_{i + 1}", np.array([x, 0.0, 0.0]), np.array([x, 0.0, 0.0]), 1.5)
        for i, x in enumerate((-0.25, 0.25))
    )
    return Rig(9.80665, cables, 1.1, 0.002, tolerance=dict(DEFAULT_TOLERANCE))


def hiding(recording: Recording) -> Recording:
    """The recording as a tracker has it that loses a marker at one end of each swing."""
    mocap = recording.mocap
    assert mocap is not None
    values = mocap.values.copy()
    turns = Rotation.from_quat(values[:, 3:])
    about = (turns * turns.mean().inv()).as_rotvec()
    hidden = (about[:, 2] > HIDDEN)[:, None]
    values[:, :3] += np.where(hidden, JUMP[:3], 0.0)
    values[:, 3:] = (Rotation.from_rotvec(np.where(hidden, JUMP[3:], 0.0)) * turns).as_quat()
    return replace(recording, mocap=Series(mocap.time, values))


@pytest.fixture(scope="module")
def sessions() -> tuple[Session, Session]:
    """A body that is let go turned by 0.3 rad, by a sound tracker and by one that loses a marker."""
    start = Posed(np.array([0.01, 0.02, -1.49]), Rotation.from_rotvec([0.0, 0.0, 0.3]).as_quat())
    runs = (RunSpec("run_1", 24.0, start), RunSpec("run_2", 14.0, start, holdout=True))
    noisy = replace(rig(), noise={"mocap_position": 3e-4, "mocap_orientation": 1e-3})
    rates = SampleRates(0.0, 0.0, 0.0, 0.0, 0.0, 100.0, 0.0)
    session, _ = simulate_session(
        SessionSpec("hiding", noisy, BODY, runs, rates=rates), np.random.default_rng(3)
    )
    sound = replace(session, rig=rig())
    return sound, replace(sound, recordings=tuple(map(hiding, sound.recordings)))


def answered(session: Session) -> Identification:
    fitted = fit_session(session)
    return compose(session, fitted, *judged(fitted), None)


def test_the_largest_turn_is_found_whatever_its_axis() -> None:
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    angle = 0.2 * np.sin(np.linspace(0.0, 20.0, 400)) + 0.05
    turning = turning_of(KEY, angle[:, None] * axis + [0.1, 0.0, 0.3])
    assert turning is not None
    assert abs(turning.axis @ axis) == pytest.approx(1.0)
    assert np.ptp(turning.angle(angle[:, None] * axis)) == pytest.approx(np.ptp(angle))
    assert turning_of(KEY, np.zeros((10, 3))) is None


def test_between_its_knots_an_error_is_straight() -> None:
    turning = turning_of(KEY, np.linspace(-0.2, 0.3, 50)[:, None] * [0.0, 0.0, 1.0])
    assert turning is not None
    inside = np.linspace(turning.knots[0], turning.knots[-1], 301)
    shapes = turning.shapes(inside)
    assert shapes.shape == (301, KNOTS)
    assert np.sum(shapes, axis=1) == pytest.approx(1.0)
    assert shapes @ turning.knots == pytest.approx(inside)


def test_of_a_tracker_s_noise_only_what_wanders_goes_with_the_pose(sessions: tuple[Session, Session]) -> None:
    sound, hidden = (with_noise_of_swing(s.rig, prepare(s.rig, s.training[0])).channels for s in sessions)
    for clean, off in zip(sound, hidden, strict=True):
        assert clean.wander is not None
        assert off.wander is not None
        assert np.all(clean.wander < 0.7 * clean.noise)
        jumps = np.abs(JUMP[:3] if clean.quantity == "position" else JUMP[3:])
        seen = off.wander[jumps > 0.0]
        assert np.all(seen > 0.1 * jumps[jumps > 0.0])
        assert np.all(seen < jumps[jumps > 0.0])


def test_a_marker_that_hides_bends_no_inertia(sessions: tuple[Session, Session]) -> None:
    answer, zz = answered(sessions[1]), ELEMENTS.index("Jzz")
    value, std = answer.total.values[zz], np.sqrt(answer.total.covariance[zz, zz])
    assert value == pytest.approx(BODY[zz], rel=0.02)
    assert abs(value - BODY[zz]) < 3.0 * std
    assert answer.holdout_error is not None
    assert answer.holdout_error < 1.2
    assert [note for note in answer.notes if "markers that hide" in note]


def test_of_a_sound_tracker_nothing_is_told(sessions: tuple[Session, Session]) -> None:
    fitted = fit_session(sessions[0])
    assert pose_errors(fitted) == ()
    assert judged(fitted)[1].verdict == "none"
