"""The instant at which a person lets go of a body, or takes hold of it, found within a swing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.estimate.first_guess import rest_of
from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.segments import FreePart, free_part
from rig_identification.recording import Recording, Series, Session
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Mount, Rig
from rig_identification.simulate import Posed, RunSpec, SampleRates, SessionSpec, simulate_session

#: A drone of half a kilogram on two threads, 0.52 Hz about the vertical.
BODY = np.array([0.458, 0.0, 0.0, -0.03, 0.0027, 0.0, 0.0, 0.004, 0.0, 0.0067])
#: Length of the recording, and of what a hand holds of it, s.
LONG, HELD = 12.0, 0.1


def rig() -> Rig:
    cables = tuple(
        Cable(f"cable_{i + 1}", np.array([x, 0.0, 0.0]), np.array([x, 0.0, 0.0]), 1.873)
        for i, x in enumerate((-0.1715, 0.1715))
    )
    noise = {"angular_rate": 1e-3, "specific_force": 0.5}
    upright = Mount(np.array([0.0, 0.0, -0.05]), np.array([0.0, 0.0, 0.0, 1.0]))
    return Rig(9.80665, cables, 0.458, 0.002, imu=upright, noise=noise, tolerance=dict(DEFAULT_TOLERANCE))


@cache
def swung() -> Session:
    """Turned by 0.2 rad and let go: a gyroscope alone watches."""
    start = Posed(np.array([0.005, 0.01, -1.9]), Rotation.from_rotvec([0.0, 0.0, 0.2]).as_quat())
    rates = SampleRates(0.0, 0.0, 0.0, 100.0, 0.0, 0.0, 0.0)
    spec = SessionSpec("drone", rig(), BODY, (RunSpec("run_1", LONG, start),), rates=rates, doubts=False)
    session = simulate_session(spec, np.random.default_rng(4))[0]
    return replace(session, recordings=(_rates(session.recordings[0]),))


def _rates(recording: Recording, held: tuple[float, float] = (0.0, 0.0)) -> Recording:
    """The recording of the gyroscope alone, the body held still between two times (s)."""
    assert recording.imu is not None
    time, values = recording.imu.time, recording.imu.values.copy()
    values[:, 3:] = np.nan
    still = (time >= held[0]) & (time < held[1])
    values[still, :3] = np.random.default_rng(5).normal(0.0, 1e-3, (int(still.sum()), 3))
    return replace(recording, imu=Series(time, values))


def found(recording: Recording, guessed: float = 1.1) -> FreePart:
    """The free part, looked for with a body of ``guessed`` times its inertia: as a first scan has it."""
    problem, theta, _ = pose_problem(replace(swung(), recordings=(recording,)))
    body = BODY.copy()
    body[4:] *= guessed
    theta = problem.bench.parameters.start(body)
    rest = rest_of(model_at(problem.bench.parameters, theta))
    return free_part(problem, problem.runs[0], theta, rest)


def test_a_body_that_is_held_for_the_first_moment_is_let_go_then() -> None:
    """Too short for the swing as a whole to look driven beside what a rough guess leaves of each."""
    part = found(_rates(swung().recordings[0], (0.0, HELD)))
    assert HELD - 0.03 <= part.start <= HELD + 0.2
    assert part.held == ((0.0, pytest.approx(part.start)),)
    assert part.run.grid.duration == pytest.approx(part.end - part.start)
    assert part.end > LONG - 0.1


def test_a_body_that_is_caught_in_the_last_moment_is_free_until_then() -> None:
    part = found(_rates(swung().recordings[0], (LONG - HELD, LONG + 1.0)))
    assert LONG - HELD - 0.2 <= part.end <= LONG - HELD + 0.03
    assert part.held[-1][0] == pytest.approx(part.end)
    assert part.start == 0.0


def test_a_body_that_swings_free_is_used_whole() -> None:
    part = found(swung().recordings[0])
    assert part.held == ()
    assert part.run.grid.duration > LONG - 0.1


def test_a_spike_at_the_start_is_no_hand() -> None:
    recording = swung().recordings[0]
    assert recording.imu is not None
    values = recording.imu.values.copy()
    values[1, 2] += 0.2
    assert found(replace(recording, imu=Series(recording.imu.time, values))).held == ()
