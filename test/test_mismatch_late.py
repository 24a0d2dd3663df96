"""A lag and a clock of one device: told apart where the body moves, not where noise is smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from rig_identification.mismatch.in_motion import cost_in_motion, unearned
from rig_identification.mismatch.late import told_apart

SAMPLES, DURATION = 4000, 40.0


def _fit(residual):  # type: ignore[no-untyped-def]
    """The least that a trial's problem and evaluation hold for one channel of one run."""
    channel = SimpleNamespace(width=1)
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
