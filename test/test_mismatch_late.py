"""A lag and a clock of one device: told apart where the body moves, not where noise is smoothed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter, lfilter_zi
from test_simulate_identify import shaken

from rig_identification.mismatch.in_motion import cost_in_motion, unearned
from rig_identification.mismatch.late import told_apart
from rig_identification.recording import Recording
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

SAMPLES, DURATION = 4000, 40.0
#: s, of one load cell.
LAG = 0.012


def _fit(residual):  # type: ignore[no-untyped-def]
    """The least that a trial's problem and evaluation hold for one channel of one run."""
    channel = SimpleNamespace(axes=(0,))
    run = SimpleNamespace(channels=(channel,), grid=SimpleNamespace(duration=DURATION))
    rows = np.zeros(SAMPLES, dtype=int)
    linearised = SimpleNamespace(residual=residual, channel=rows, axis=rows, log_spread=0.0)
    return SimpleNamespace(runs=(run,)), SimpleNamespace(runs=(linearised,))


@dataclass(frozen=True)
class _Trial:
    candidate: SimpleNamespace
    problem: SimpleNamespace
    evaluation: SimpleNamespace
    evidence: float


def _trial(effect: str, residual, evidence: float) -> _Trial:  # type: ignore[no-untyped-def]
    return _Trial(SimpleNamespace(effect=effect, where={"channel": "imu"}), *_fit(residual), evidence)


def test_only_what_the_body_can_do_counts() -> None:
    time = np.arange(SAMPLES) * DURATION / SAMPLES
    slow, fast = np.sin(2 * np.pi * 1.0 * time), np.sin(2 * np.pi * 30.0 * time)
    # A whole number of periods: half the sum of squares, with and without the first second
    assert np.isclose(cost_in_motion(*_fit(slow)), 0.25 * SAMPLES, rtol=1e-6)
    without = cost_in_motion(*_fit(slow), settling=1.0)
    assert np.isclose(without, 0.25 * SAMPLES * (1 - 1.0 / DURATION), rtol=1e-3)
    assert cost_in_motion(*_fit(fast)) < 1e-6 * SAMPLES


def test_a_gain_from_noise_alone_is_not_earned() -> None:
    rng = np.random.default_rng(4)
    time = np.arange(SAMPLES) * DURATION / SAMPLES
    swing = 0.5 * np.sin(2 * np.pi * 1.0 * time)
    noise = rng.normal(size=SAMPLES)
    noise *= np.sqrt(SAMPLES / np.sum(noise**2))
    problem, before = _fit(noise + swing)
    # What follows the body is earned, however much it is
    assert unearned(problem, before, _fit(noise)[1].runs) < 1.0
    # A tenth less of white noise is not, nor are spreads that shrink with it
    calmer = _fit(0.9 * noise + swing)[1].runs
    assert unearned(problem, before, calmer) == pytest.approx(0.5 * 0.19 * SAMPLES, rel=0.15)
    calmer[0].log_spread = -200.0
    assert unearned(problem, before, calmer) == pytest.approx(0.5 * 0.19 * SAMPLES + 200.0, rel=0.15)
    # An excess at frequencies where nothing should move may be taken away
    problem, loud = _fit(1.1 * noise)
    assert unearned(problem, loud, _fit(noise)[1].runs) < 0.02 * SAMPLES


def test_a_lag_that_only_smooths_noise_is_a_clock() -> None:
    noise = np.random.default_rng(1).normal(size=SAMPLES)
    spectrum = np.fft.rfft(noise)
    smooth = spectrum * np.where(np.fft.rfftfreq(SAMPLES, DURATION / SAMPLES) > 10.0, 0.98, 1.0)
    lag = _trial("sensor_lag", np.fft.irfft(smooth), 40.0)
    clock = _trial("clock_offset", noise, 0.0)
    first, second = told_apart([lag, clock], 3.0)  # type: ignore[list-item]
    assert first.candidate.effect == "clock_offset"
    assert 0.0 <= first.evidence - second.evidence < 3.0


def test_a_lag_that_follows_the_body_better_stays_first() -> None:
    time = np.arange(SAMPLES) * DURATION / SAMPLES
    noise = np.random.default_rng(2).normal(size=SAMPLES)
    lag = _trial("sensor_lag", noise, 40.0)
    clock = _trial("clock_offset", noise + 0.3 * np.sin(2 * np.pi * 1.2 * time), 0.0)
    first, second = told_apart([lag, clock], 3.0)  # type: ignore[list-item]
    assert first.candidate.effect == "sensor_lag"
    assert first.evidence - second.evidence == 40.0


@pytest.mark.long
def test_a_lag_is_told_before_the_clock_that_is_alike_to_it() -> None:
    """The clock leaves next to nothing, and keeps the lag from being tried unless it is asked for."""
    made, _ = simulate_session(shaken(14, 12.0), np.random.default_rng(8))
    name = next(iter(made.recordings[-1].tension))
    found = identify(replace(made, recordings=tuple(_slow(r, name) for r in made.recordings)))
    assert found.mismatch.findings[0].effect == "sensor_lag"
    assert found.mismatch.findings[0].where["channel"] == name
    told = found.mismatch.findings[0].parameters["time_constant"]
    assert abs(told["value"] - LAG) < 4.0 * told["std"]  # type: ignore[operator]


def _slow(recording: Recording, name: str) -> Recording:
    tension = recording.tension[name]
    step = float(np.median(np.diff(tension.time)))
    numerator, denominator, _ = cont2discrete(([1.0], [LAG, 1.0]), step, method="foh")
    first = lfilter_zi(numerator[0], denominator) * tension.values[0, 0]
    slow, _ = lfilter(numerator[0], denominator, tension.values[:, 0], zi=first)
    return replace(recording, tension={**recording.tension, name: replace(tension, values=slow[:, None])})


def test_what_a_piece_does_not_know_of_before_it_says_nothing() -> None:
    time = np.arange(SAMPLES) * DURATION / SAMPLES
    noise = np.random.default_rng(1).normal(size=SAMPLES)
    # The clock leaves some of the motion; an open state at every start costs the lag more than that
    clock = _trial("clock_offset", noise + 0.15 * np.sin(2 * np.pi * 1.0 * time), 0.0)
    lag = _trial("sensor_lag", noise, -20.0)
    first, second = told_apart([clock, lag], 3.0)  # type: ignore[list-item]
    assert first.candidate.effect == "sensor_lag"
    assert first.evidence - second.evidence > 3.0
