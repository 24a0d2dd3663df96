"""What damps a body of which one rate is all that is measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig_identification.recording import Recording
from rig_identification.result import ELEMENTS
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Mount, Rig
from rig_identification.search.identify import identify
from rig_identification.simulate import Posed, RunSpec, SampleRates, SessionSpec, simulate_session

BODY = np.array([1.1, 0.0, 0.0, -0.08, 0.05, 0.0, 0.0, 0.04, 0.0, 0.075])
#: Rates (rad/s) of a bias that wanders, of less than half the turn's frequency.
WANDER, SLOW = 3e-4, 0.03


def one_rate(recording: Recording) -> Recording:
    """The recording of a gyroscope that tells the rate about the vertical alone, and wanders."""
    assert recording.imu is not None
    values = np.full_like(recording.imu.values, np.nan)
    drift = WANDER * np.sin(2.0 * np.pi * SLOW * recording.imu.time)
    values[:, 2] = recording.imu.values[:, 2] + drift
    return replace(recording, imu=replace(recording.imu, values=values))


@pytest.mark.long
def test_linear_and_square_damping_of_one_turn_are_told_with_its_inertia() -> None:
    cables = tuple(
        Cable(f"cable_{i + 1}", np.array([x, 0.0, 0.0]), np.array([x, 0.0, 0.0]), 1.5)
        for i, x in enumerate((-0.25, 0.25))
    )
    imu = Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    noise = {"angular_rate": 0.002, "specific_force": 0.5}
    rig = Rig(9.80665, cables, 1.1, 0.002, imu=imu, noise=noise, tolerance=dict(DEFAULT_TOLERANCE))
    start = (
        Posed(np.array([0.0, 0.0, -1.49]), Rotation.from_rotvec([0, 0, a]).as_quat()) for a in (0.5, 0.3)
    )
    spec = SessionSpec(
        "one turn",
        rig,
        BODY,
        (RunSpec("run_1", 40.0, next(start)), RunSpec("run_2", 30.0, next(start), holdout=True)),
        rates=SampleRates(0.0, 0.0, 0.0, 20.0, 0.0, 0.0, 0.0),
        effects={"hinge_damping": (0.002,), "air_plates": (0.6, 0.0), "air_plates.reach": (0.25,)},
    )
    session = simulate_session(spec, np.random.default_rng(4))[0]
    session = replace(session, recordings=tuple(map(one_rate, session.recordings)))
    answer = identify(session)
    assert answer.mismatch.verdict == "explained"
    assert {f.effect for f in answer.mismatch.findings} >= {"air_drag"}
    zz = ELEMENTS.index("Jzz")
    std = float(np.sqrt(answer.total.covariance[zz, zz]))
    assert abs(answer.total.values[zz] - BODY[zz]) < 3.0 * std
    assert std < 0.05 * BODY[zz]
    assert answer.holdout_error == pytest.approx(1.0, abs=0.15)
