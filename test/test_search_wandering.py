"""Zeros that move in and between recordings by no law are told, and take nothing else with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import Ideal, fit_session, judged
from rig_identification.mismatch.budget import UNLIMITED
from rig_identification.recording import Recording, Session
from rig_identification.search.wandering import wandering_zeros
from rig_identification.simulate import simulate_session

#: rad/s about z: offset at the start of each run, and drift, rad/s^2.
MOVES = {"run_1": (2e-3, 2e-4), "run_2": (-4e-3, 1e-4)}


def quiet(text: str, share: float = 0.0) -> None:
    """Nobody listens."""


def simulated(effects: dict[str, tuple[float, ...]]) -> Session:
    spec = shaken(14, 10.0)
    (run,) = spec.runs
    runs = (run, replace(run, name="run_2", holdout=True))
    spec = replace(spec, runs=runs, effects=effects, doubts=False)
    return simulate_session(spec, np.random.default_rng(5))[0]


def moved(recording: Recording) -> Recording:
    """The recording with a gyroscope whose zero about z moves."""
    series = recording.imu
    if recording.name not in MOVES or series is None:
        return recording
    offset, drift = MOVES[recording.name]
    values = series.values.copy()
    values[:, 2] += offset + drift * series.time
    return replace(recording, imu=replace(series, values=values))


def ideal_of(session: Session) -> Ideal:
    fitted = fit_session(session)
    return Ideal(fitted, *judged(fitted))


def test_a_gyroscope_that_warms_up_is_told_by_its_axis_and_how_far_it_moves() -> None:
    session = simulated({})
    session = replace(session, recordings=tuple(map(moved, session.recordings)))
    ideal = ideal_of(session)
    assert ideal.mismatch.verdict == "unexplained"
    found = wandering_zeros(ideal, quiet, UNLIMITED)
    assert found is not None
    assert found.mismatch.verdict == "explained"
    (finding,) = found.mismatch.findings
    assert (finding.effect, finding.where["channel"], finding.where["axis"]) == ("imu_bias", "imu", "z")
    most = finding.parameters["angular_rate"]
    # The largest of both runs: where the first one ends, or the second one begins
    assert most["value"] == pytest.approx(-4e-3, abs=2e-4) or most["value"] == pytest.approx(4e-3, abs=2e-4)
    after = finding.evidence["holdout_error_after"]
    assert after is not None
    assert after < 1.05
    assert "run_2" in finding.statement


def test_a_law_of_the_motion_is_no_zero_that_moves() -> None:
    ideal = ideal_of(simulated({"point_law.brake": (100.0, 0.0), "point_law.position": (0.2, 0.4, -0.3)}))
    assert ideal.mismatch.verdict == "unexplained"
    assert wandering_zeros(ideal, quiet, UNLIMITED) is None
