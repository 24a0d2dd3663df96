"""Noise that is not white shows at rest, and counts in the runs; white noise counts as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from test_simulate_identify import shaken

from rig_identification.estimate.identify import pose_problem
from rig_identification.estimate.noise_at_rest import FORCE, Colour, told, with_slow_noise
from rig_identification.recording import Recording, Series, Session
from rig_identification.simulate import simulate_session

Array = NDArray[np.float64]
RHO = 0.4


def hanging(rho: float, seed: int) -> Session:
    """Recordings whose cell of cable_2 reads rest with noise of correlation ``rho`` from sample to sample."""
    session, _ = simulate_session(shaken(14, 2.0), np.random.default_rng(1))
    rng, std = np.random.default_rng(seed), session.rig.noise["tension"]

    def longer(recording: Recording) -> Recording:
        if recording.kind == "dynamic":
            return recording
        white = rng.normal(size=4000) * std * np.sqrt(1.0 - rho**2)
        values = np.mean(recording.tension["cable_2"].values) + lfilter([1.0], [1.0, -rho], white)
        series = Series(np.arange(4000) / 200.0, values[:, None])
        return replace(recording, duration=20.0, tension={**recording.tension, "cable_2": series})

    return replace(session, recordings=tuple(map(longer, session.recordings)))


@pytest.mark.parametrize("seed", range(4))
def test_white_noise_is_as_described(seed: int) -> None:
    problem, _, _ = pose_problem(hanging(0.0, seed))
    assert told(problem.runs) == ()


def test_correlated_noise_is_stronger_where_the_body_moves() -> None:
    """Its spectrum is (1 + rho)/(1 - rho) times its variance at the lower end; the note names the cell."""
    problem, _, _ = pose_problem(hanging(RHO, 3))
    channels = [c for run in problem.runs for c in run.channels if c.quantity == "tension"]
    seen = {c.device: c for c in channels if c.slow is not None}
    assert list(seen) == ["cable_2"]
    cell = seen["cable_2"]
    assert cell.slow is not None
    assert cell.slow[0] == pytest.approx(np.sqrt((1.0 + RHO) / (1.0 - RHO)), rel=0.12)
    plain = replace(cell, slow=None)
    np.testing.assert_allclose(cell.grouped_variance, plain.grouped_variance * cell.slow[0] ** 2)
    assert "cable_2: its tension" in told(problem.runs)[0]


def test_an_axis_that_shows_nothing_is_as_noisy_as_elsewhere() -> None:
    """Its samples are all the same: no frequency is one at which it moves."""
    problem, _, _ = pose_problem(hanging(0.0, 1))
    run = problem.runs[0]
    cell = next(c for c in run.channels if c.quantity == "tension")
    still = replace(run, channels=(replace(cell, values=np.full_like(cell.values, 100.0)),))
    colour = Colour(0.01, np.zeros(1), np.array([0.5]), np.array([True]), np.array([0.6]))
    (louder,) = with_slow_noise((still,), {(cell.device, cell.quantity): colour})
    assert louder.channels[0].slow == pytest.approx([np.exp(0.3)])
    white = with_slow_noise((run,), {FORCE: colour})[0]
    assert white.channels == run.channels


def test_what_noise_leaves_at_each_frequency_is_no_evidence() -> None:
    """Louder than taken for where the spectrum says so, and nowhere quieter."""
    colour = Colour(0.01, np.zeros(1), np.array([0.5]), np.array([True]), np.array([0.6]))
    problem, _, _ = pose_problem(hanging(0.0, 1))
    cell = next(c for c in problem.runs[0].channels if c.quantity == "tension")
    cell = replace(cell, slow=np.array([1.1]), colour=colour)
    low, high = cell.power_of_noise(cell.axes[0], np.array([0.0, 45.0]))
    assert low == pytest.approx(np.exp(0.5) / 1.21)
    assert high == 1.0
