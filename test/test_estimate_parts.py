"""What is measured in part: the same body from a gyroscope alone, one rate, an attitude, an angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_model_rigs import bifilar

from rig_identification.estimate.evidence import prepare
from rig_identification.estimate.hung_by_eye import BESIDE
from rig_identification.estimate.identify import fit_session, judged
from rig_identification.estimate.observability import inertial_estimate
from rig_identification.model.motion import on_cables
from rig_identification.recording import Series, Session
from rig_identification.result import ELEMENTS, InertialEstimate
from rig_identification.rig import Mount
from rig_identification.simulate import simulate_session
from rig_identification.simulate.spec import RunSpec, SampleRates, SessionSpec
from rig_identification.simulate.start import Posed

JZZ = ELEMENTS.index("Jzz")
NOISE = {"angular_rate": 1e-3, "specific_force": 0.02, "mocap_position": 5e-4, "mocap_orientation": 1e-3}
#: Where the tracker's marker sits, and the IMU beside the datum.
MARKER = Mount(np.array([0.5, 0.3, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))
UPRIGHT = Mount(np.array([1.2, -0.4, 0.1]), np.array([0.0, 0.0, np.sin(0.2), np.cos(0.2)]))
#: Columns of the tracker's and the IMU's series.
X, Y, Z = range(3)


@pytest.fixture(scope="module")
def turning() -> tuple[Session, np.ndarray]:
    """A body on two strings, let go turned by 0.2 rad; the centre of mass hangs 1 cm beside the middle."""
    sample = bifilar()
    elements = sample.elements.copy()
    elements[1:4] = [0.01, 0.0, -0.3]
    rig = replace(
        sample.rig,
        noise=NOISE,
        mocap=MARKER,
        exciter=None,
        inclinometer=None,
        imu=Mount(np.zeros(3), MARKER.orientation),
    )
    sample = replace(sample, rig=rig, elements=elements)

    def let_go(turn: float) -> Posed:
        turned = replace(sample.start, R_world_body=Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix())
        state = on_cables(sample.model(), turned)
        return Posed(state.position, Rotation.from_matrix(state.R_world_body).as_quat())

    runs = (RunSpec("run_1", 12.0, let_go(0.2)), RunSpec("run_2", 8.0, let_go(-0.15), holdout=True))
    rates = SampleRates(tension=0.0, exciter=0.0, imu=50.0, inclinometer=0.0, mocap=30.0, ground_truth=0.0)
    spec = SessionSpec(
        "turning", rig, elements, runs=runs, rates=rates, doubts=False, world_in_tracker=UPRIGHT
    )
    session, truth = simulate_session(spec, np.random.default_rng(5))
    return session, truth.elements


def blanked(session: Session, imu: list[int] | None, mocap: list[int] | None) -> Session:
    """The session with the columns given not measured; None: without the device."""

    def without(series: Series | None, columns: list[int] | None) -> Series | None:
        if series is None or columns is None:
            return None
        values = series.values.copy()
        values[:, columns] = np.nan
        return replace(series, values=values)

    recordings = tuple(
        replace(r, imu=without(r.imu, imu), mocap=without(r.mocap, mocap)) for r in session.recordings
    )
    return replace(session, recordings=recordings)


def heading_alone(session: Session) -> Session:
    """The session with nothing but the turn about the tracker's z."""
    recordings = []
    for r in blanked(session, None, []).recordings:
        assert r.mocap is not None
        turn = Rotation.from_quat(r.mocap.values[:, 3:]).as_rotvec()[:, 2]
        nan = np.full((turn.size, 5), np.nan)
        values = np.column_stack([nan, np.sin(0.5 * turn), np.cos(0.5 * turn)])
        recordings.append(replace(r, mocap=Series(r.mocap.time, values)))
    return replace(session, recordings=tuple(recordings))


def answer(session: Session) -> InertialEstimate:
    fitted = fit_session(session)
    verdict = judged(fitted)[1]
    assert verdict.verdict == "none", verdict.explanation
    return inertial_estimate(fitted.problem, fitted.evaluation)


@pytest.fixture(scope="module")
def whole(turning: tuple[Session, np.ndarray]) -> InertialEstimate:
    return answer(blanked(turning[0], None, []))


PARTS = {
    "gyroscope": ([3, 4, 5], None),
    "one_rate": ([0, 1, 3, 4, 5], None),
    "attitude": (None, [X, Y, Z]),
    "heading": (None, []),
}


@pytest.mark.parametrize("part", PARTS)
def test_a_part_tells_the_same_body_less_surely(
    turning: tuple[Session, np.ndarray], whole: InertialEstimate, part: str
) -> None:
    session, truth = turning
    less = heading_alone(session) if part == "heading" else blanked(session, *PARTS[part])
    told = answer(less)
    std = float(np.sqrt(told.covariance[JZZ, JZZ]))
    assert "Jzz" not in told.unobservable
    assert abs(told.values[JZZ] - truth[JZZ]) < 4.0 * std
    assert std > 0.9 * float(np.sqrt(whole.covariance[JZZ, JZZ]))
    # Nothing but turns: where the centre of mass hangs is taken, and not told
    assert {"cx", "cy"} <= set(told.unobservable)
    assert std > 2.0 * BESIDE**2 * truth[JZZ]


def test_samples_in_which_a_part_is_missing_are_used_for_the_rest(
    turning: tuple[Session, np.ndarray],
) -> None:
    recording = turning[0].recordings[0]
    assert recording.mocap is not None
    values = recording.mocap.values.copy()
    hidden = slice(100, 160)
    values[hidden, [X]] = np.nan
    run = prepare(turning[0].rig, replace(recording, imu=None, mocap=Series(recording.mocap.time, values)))
    places = {c.components: c for c in run.channels if c.quantity == "position"}
    assert set(places) == {(0, 1, 2), (1, 2)}
    assert places[1, 2].time.size == 60
    seen = np.isin(recording.mocap.time, places[1, 2].time)
    np.testing.assert_array_equal(places[1, 2].values, values[seen][:, [Y, Z]])
    turns = [c for c in run.channels if c.quantity == "orientation"]
    assert [c.components for c in turns] == [(3, 4, 5)]
    assert {c.axes for c in run.channels} == {(0, 1, 2), (1, 2)}
