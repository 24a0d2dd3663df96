"""A lag and a clock of one device: told apart where the body moves, not where noise is smoothed."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from rig_identification.mismatch.late import cost_in_motion, told_apart

SAMPLES, DURATION = 4000, 40.0


def _fit(residual):  # type: ignore[no-untyped-def]
    """The least that a trial's problem and evaluation hold for one channel of one run."""
    channel = SimpleNamespace(width=1)
    run = SimpleNamespace(channels=(channel,), grid=SimpleNamespace(duration=DURATION))
    rows = np.zeros(SAMPLES, dtype=int)
    linearised = SimpleNamespace(residual=residual, channel=rows, axis=rows)
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
    # A whole number of periods: half the sum of squares, less the first second
    assert np.isclose(cost_in_motion(*_fit(slow)), 0.25 * SAMPLES * (1 - 1.0 / DURATION), rtol=1e-3)
    assert cost_in_motion(*_fit(fast)) < 1e-6 * SAMPLES


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
