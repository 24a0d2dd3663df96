"""An exciter's force without what is noise alone: what is kept, what is left, and what is claimed of it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import welch

from rig_identification.estimate.band_limited import shaping
from rig_identification.estimate.sampling import Grid, NodeInput
from rig_identification.estimate.smooth_force import smooth_force

Array = NDArray[np.float64]
NOISE = np.full(1, 0.5)
TIME = np.arange(0.0005, 30.0, 0.002)


def turning(at: Array, frequency: float = 2.0, second: float = 0.0) -> Array:
    """(n, 1) N of a motor that comes up to speed in four seconds, from a recording's first sample on."""
    share = np.clip(at / 4.0, 0.0, 1.0)
    ramp = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    turned = 4.0 * share**4 * (2.5 - 3.0 * share + share**2) + np.maximum(at - 4.0, 0.0)
    phase = 2.0 * np.pi * frequency * turned
    force = 600.0 * ramp**2 * np.sin(phase) + second * ramp**2 * np.sin(2.0 * phase)
    return np.asarray(force)[:, None]


def read(force: Array, seed: int = 1) -> Array:
    return force + NOISE * np.random.default_rng(seed).normal(size=force.shape)


def found(step: float, force: Array, seed: int = 1) -> NodeInput | None:
    return smooth_force(Grid(step, int(29.9 / step)), TIME, read(force, seed), NOISE)


@pytest.mark.parametrize("step", [0.005, 0.01])
@pytest.mark.parametrize("frequency", [0.8, 2.0, 3.5])
def test_a_motor_s_force_is_kept_and_most_of_its_noise_is_not(step: float, frequency: float) -> None:
    at = step * np.arange(int(29.9 / step))
    true = turning(at, frequency)
    smooth = found(step, turning(TIME, frequency))
    assert smooth is not None
    assert smooth.cutoff > 0.0
    # As a mean over half a cycle of the highest frequency that is kept averages the samples' noise
    expected = float(NOISE[0]) * np.sqrt(2.0 * smooth.cutoff * 0.002)
    error = (smooth.values - true)[:, 0]
    assert np.std(error) == pytest.approx(expected, rel=0.25)
    middle = turning(at + 0.5 * step, frequency)[:-1] - 0.5 * (true[1:] + true[:-1])
    # A line between nodes misses the middle; the spline, but where it ends, does not
    known = slice(round(0.2 / step), -round(0.2 / step))
    off = (smooth.middle[:-1] - middle)[known]
    assert np.max(np.abs(off)) < 0.2 * expected


def test_what_is_claimed_of_the_noise_is_what_noise_does() -> None:
    """Its power over a long time and up to where the spline ends, of the force, and that of its rate."""
    step = 0.01
    rates, slow, power = [], [], []
    for seed in range(40):
        smooth = found(step, np.zeros((TIME.size, 1)), seed)
        assert smooth is not None
        inside = smooth.values[100:-100, 0]
        rates.append(np.var(smooth.late_by(0.0)[2][100:-100, 0]))
        # Means of half a second
        slow.append(np.mean(inside[: 50 * (inside.size // 50)].reshape(-1, 50).mean(axis=1) ** 2))
        frequency, density = welch(inside, 1.0 / step, nperseg=512)
        power.append(density)
    below = float(NOISE[0]) ** 2 * 2.0 * smooth.cutoff * 0.002
    assert np.mean(rates) == pytest.approx(smooth.rate_noise * below, rel=0.25)
    assert np.mean(slow) == pytest.approx(float(NOISE[0]) ** 2 * 0.002 / 0.5, rel=0.1)
    # What is claimed: white noise of nodes with the same power, band by band
    follow, reads = shaping(smooth.cutoff, step)
    rng = np.random.default_rng(3)
    new = np.linalg.cholesky(np.eye(len(reads)) - follow @ follow.T)
    state, made = rng.normal(size=len(reads)), np.empty(40 * smooth.values.shape[0])
    for k in range(made.size):
        made[k] = reads @ state
        state = follow @ state + new @ rng.normal(size=len(reads))
    made *= float(NOISE[0]) * np.sqrt(0.002 / step)
    claimed, kept = welch(made, 1.0 / step, nperseg=512)[1], np.mean(power, axis=0)
    for low, high in ((0.1, 0.5), (0.5, 0.75), (0.75, 1.0), (1.0, 1.2)):
        band = (frequency > low * smooth.cutoff) & (frequency < high * smooth.cutoff)
        assert np.sum(claimed[band]) == pytest.approx(np.sum(kept[band]), rel=0.15)
    assert np.sum(claimed[frequency > 1.6 * smooth.cutoff]) < 2e-3 * np.sum(claimed)


def test_a_higher_harmonic_is_kept() -> None:
    """What noise hides from sample to sample, 0.4 N at 7 Hz, is a line of the spectrum and stays."""
    smooth = found(0.005, turning(TIME, 3.5, second=0.4))
    plain = found(0.005, turning(TIME, 3.5))
    assert smooth is not None
    assert plain is not None
    at = 0.005 * np.arange(smooth.values.shape[0])
    harmonic = turning(at, 3.5, second=0.4) - turning(at, 3.5)
    told = smooth.values - plain.values
    assert np.sum(told * harmonic) / np.sum(harmonic**2) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("what", ["step", "pulses", "hum", "louder"])
def test_a_force_that_is_not_smooth_is_left_as_it_is(what: str) -> None:
    force = turning(TIME)
    rng = np.random.default_rng(3)
    if what == "step":
        force[TIME > 17.0] += 8.0
    elif what == "pulses":
        force += 40.0 * (np.abs(TIME - 11.0) < 0.004)[:, None]
    elif what == "hum":
        force += 0.3 * np.sin(2.0 * np.pi * 50.0 * TIME)[:, None]
    else:
        # Noise that comes and goes is not what the lab says that it is
        force += (np.abs(TIME - 20.0) < 1.0)[:, None] * rng.normal(0.0, 0.4, (TIME.size, 1))
    assert found(0.005, force) is None


def test_noise_that_is_not_known_smooths_nothing() -> None:
    grid = Grid(0.01, 2900)
    force = turning(TIME)
    assert smooth_force(grid, TIME, force, np.zeros(1)) is None
    assert smooth_force(grid, TIME[:40], force[:40], NOISE) is None
    assert smooth_force(grid, TIME, read(force), 0.5 * NOISE) is None


def test_a_recording_without_the_noise_that_is_described_loses_nothing() -> None:
    smooth = smooth_force(Grid(0.01, 2900), TIME, turning(TIME), NOISE)
    assert smooth is not None
    at = 0.01 * np.arange(2900)
    assert np.max(np.abs(smooth.values - turning(at))[20:-20]) < 0.002 * float(NOISE[0])
