"""A push far below the noise of any second, which the rest of its run remembers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_simulate_identify import shaken
from wrong_sessions import moved

from rig_identification.estimate.identify import Ideal, fit_session, judged
from rig_identification.mismatch.pulse import likeliest_pulse
from rig_identification.recording import Session
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

PUSH, START, LASTS = 25.0, 9.0, 0.8  # N at the peak along the exciter's z; s


def _session(pushed: str | None, push: float = PUSH) -> Session:
    """Two runs, the second held out; in one of them something pushes."""
    spec = shaken(14, 20.0)
    (run,) = spec.runs
    other = replace(run, name="run_2", holdout=True, duration=16.0)
    made = simulate_session(replace(spec, runs=(run, other)), np.random.default_rng(11))[0]
    recordings = tuple(moved(r, push, START, LASTS) if r.name == pushed else r for r in made.recordings)
    return replace(made, recordings=recordings)


@pytest.mark.parametrize("pushed", ["run_1", "run_2"])
def test_a_gentle_push_is_found_in_a_fitted_run_and_in_one_held_out(pushed: str) -> None:
    found = identify(_session(pushed))
    assert found.mismatch.verdict == "explained"
    (push,) = found.mismatch.findings
    assert push.effect == "external_force"
    (times,) = push.where["times"]  # type: ignore[misc]
    assert times["recording"] == pushed
    assert times["start"] == pytest.approx(START, abs=0.1)
    assert times["end"] == pytest.approx(START + LASTS, abs=0.1)
    peak = np.array([push.parameters[f"peak_force_{a}"]["value"] for a in "xyz"])
    stds = np.array([push.parameters[f"peak_force_{a}"]["std"] for a in "xyz"])
    assert np.linalg.norm(peak) == pytest.approx(PUSH, abs=4.0 * float(np.max(stds)))
    assert found.holdout_error is not None
    assert found.holdout_error < 1.1


@pytest.mark.long
def test_two_strong_pushes_are_told_with_their_own_times_and_forces() -> None:
    session = _session("run_1", 300.0)
    twice = tuple(moved(r, 200.0, 14.0, 1.0) if r.name == "run_1" else r for r in session.recordings)
    found = identify(replace(session, recordings=twice))
    assert found.mismatch.verdict == "explained"
    pushes = [f for f in found.mismatch.findings if f.effect == "external_force"]
    assert len(pushes) == 2
    for push, start, end, size in zip(
        pushes, (START, 14.0), (START + LASTS, 15.0), (300.0, 200.0), strict=True
    ):
        (times,) = push.where["times"]  # type: ignore[misc]
        assert times["start"] == pytest.approx(start, abs=0.2)
        assert times["end"] == pytest.approx(end, abs=0.2)
        peak = np.linalg.norm([push.parameters[f"peak_force_{a}"]["value"] for a in "xyz"])
        assert peak == pytest.approx(size, rel=0.1)


def test_noise_alone_holds_no_push() -> None:
    fitted = fit_session(_session(None))
    assert Ideal(fitted, *judged(fitted)).mismatch.verdict == "none"
    pulse = likeliest_pulse(fitted)
    assert pulse is not None
    assert pulse.net < 0.0


def test_what_acts_for_as_good_as_ever_is_no_push() -> None:
    spec = shaken(14, 20.0)
    made = simulate_session(spec, np.random.default_rng(11))[0]
    recordings = tuple(moved(r, PUSH, 0.5, 39.0) if r.name == "run_1" else r for r in made.recordings)
    drawn = replace(made, recordings=recordings)
    fitted = fit_session(drawn)
    assert Ideal(fitted, *judged(fitted)).mismatch.verdict != "none"
    assert likeliest_pulse(fitted) is None
