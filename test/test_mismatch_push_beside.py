"""A push that the recorded force does not know, beside a gyroscope's bias that is larger everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken

from rig_identification.estimate.identify import fit_session
from rig_identification.mismatch.push import all_without
from rig_identification.recording import Recording, Session
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

BIAS = 0.012  # rad/s about x, some hundred samples' noise
PUSH, START, LASTS = 120.0, 14.0, 1.2  # N at the peak along the exciter's z; s


def biased(recording: Recording, bias: float) -> Recording:
    """The recording as a gyroscope with a bias (rad/s) about x would have made it."""
    if recording.imu is None:
        return recording
    values = recording.imu.values.copy()
    values[:, 0] += bias
    return replace(recording, imu=replace(recording.imu, values=values))


def moved(recording: Recording, peak: float, start: float, lasts: float) -> Recording:
    """The recording as if part of its force had come from outside: the exciter's cell did not feel it.

    peak: N along the exciter's z. start, lasts: s of half a sine.
    """
    force = recording.exciter_force
    assert force is not None
    phase = (force.time - start) / lasts
    pulse = np.where((phase > 0.0) & (phase < 1.0), peak * np.sin(np.pi * np.clip(phase, 0.0, 1.0)), 0.0)
    values = force.values.copy()
    values[:, 2] -= pulse
    return replace(recording, exciter_force=replace(force, values=values))


@pytest.fixture(scope="module")
def session() -> Session:
    spec = shaken(14, 24.0)
    (run,) = spec.runs
    other = replace(run, name="run_2", holdout=True, duration=12.0)
    made = simulate_session(replace(spec, runs=(run, other)), np.random.default_rng(8))[0]
    recordings = tuple(
        biased(moved(r, PUSH, START, LASTS) if r.name == "run_1" else r, BIAS) for r in made.recordings
    )
    return replace(made, recordings=recordings)


def test_both_are_named(session: Session) -> None:
    found = identify(session)
    mismatch = found.mismatch
    assert mismatch.verdict == "explained"
    bias, push = mismatch.findings
    assert (bias.effect, bias.where["channel"], bias.where["axis"]) == ("imu_bias", "imu", "x")
    assert bias.parameters["angular_rate"]["value"] == pytest.approx(BIAS, abs=1e-3)
    assert push.effect == "external_force"
    (times,) = push.where["times"]  # type: ignore[misc]
    assert times["recording"] == "run_1"
    assert times["start"] < START + LASTS
    assert times["end"] > START
    assert found.holdout_error is not None
    assert found.holdout_error < 1.1
    assert "push" in mismatch.explanation


def test_a_push_leaves_other_stretches_of_its_recording_alone() -> None:
    run = fit_session(simulate_session(shaken(14, 24.0), np.random.default_rng(3))[0], _quiet, None)
    whole = run.problem.runs[0]
    middle, last = whole.grid.nodes // 2, whole.grid.nodes - 1
    early, late = whole.between(0, middle), whole.between(middle, last)
    before, after, untouched = all_without((early, late), whole.recording.name, 2.0, 3.0)
    assert untouched is late
    assert before.offset == early.offset
    assert after.offset > 3.0
    assert [r.offset for r in all_without((late,), "another", 2.0, 3.0)] == [late.offset]


def _quiet(stage: str, share: float) -> None:
    """No progress is shown."""
