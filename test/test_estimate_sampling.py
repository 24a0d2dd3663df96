"""From nodes to samples and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rig_identification.estimate.sampling import (
    Grid,
    Sampler,
    cubic_error,
    group_by_node,
    interpolation,
    jumps_of,
    node_input,
    node_values,
    noise_felt,
    sample_noise_std,
    worst_cubic_error,
)
from rig_identification.estimate.smoothing import WIDTHS, rate_noise, smoothed_input

GRID = Grid(0.01, 201)
COEFFICIENTS = arrays(float, 4, elements=st.floats(-3.0, 3.0))


def nodes() -> np.ndarray:
    return GRID.step * np.arange(GRID.nodes)


@given(COEFFICIENTS, arrays(float, 25, elements=st.floats(0.0, 2.0)))
def test_cubics_are_interpolated_exactly(c: np.ndarray, time: np.ndarray) -> None:
    polynomial = np.polynomial.Polynomial(c)
    value, slope = interpolation(GRID, time, np.arange(25), 25)
    np.testing.assert_allclose(value @ polynomial(nodes()), polynomial(time), atol=1e-11)
    np.testing.assert_allclose(slope @ polynomial(nodes()), polynomial.deriv()(time), atol=1e-8)


def test_samples_on_nodes_are_the_nodes() -> None:
    values = np.random.default_rng(0).normal(size=GRID.nodes)
    value, _ = interpolation(GRID, nodes(), np.arange(GRID.nodes), GRID.nodes)
    np.testing.assert_allclose(value @ values, values, atol=1e-12)


def test_interpolation_error_is_of_fourth_order() -> None:
    time = np.random.default_rng(1).uniform(0.1, 1.9, 500)
    errors = []
    for step in (0.02, 0.01):
        grid = Grid(step, round(2.0 / step) + 1)
        value, _ = interpolation(grid, time, np.arange(500), 500)
        at = step * np.arange(grid.nodes)
        errors.append(np.max(np.abs(value @ np.sin(9.0 * at) - np.sin(9.0 * time))))
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.2)


@given(st.integers(0, 1000), st.floats(100.0, 2000.0))
def test_groups_hold_the_samples_nearest_their_node(seed: int, rate: float) -> None:
    rng = np.random.default_rng(seed)
    time = np.sort(rng.uniform(0.0, GRID.duration, int(rate)))
    group, node = group_by_node(GRID, time)
    assert np.all(np.diff(node) > 0)
    assert np.all(np.bincount(group, minlength=node.size) > 0)
    assert np.max(np.abs(time - GRID.step * node[group])) <= 0.5 * GRID.step * (1.0 + 1e-9)
    # Mean over the group of the interpolated values, and of the samples: the same linear map
    value, _ = interpolation(GRID, time, group, node.size)
    expected = np.bincount(group, time) / np.bincount(group)
    np.testing.assert_allclose(value @ nodes(), expected, atol=1e-12)
    np.testing.assert_allclose(value @ np.ones(GRID.nodes), 1.0, atol=1e-12)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.integers(0, 1000))
def test_straight_lines_go_through_node_values_even_across_a_gap(a: float, b: float, seed: int) -> None:
    time = np.sort(np.random.default_rng(seed).uniform(0.0, GRID.duration, 900))
    time = time[(time < 0.7) | (time > 0.9)]
    fitted = node_values(GRID, time, (a + b * time)[:, None])
    np.testing.assert_allclose(fitted[:, 0], a + b * nodes(), atol=1e-8)


def test_node_values_keep_the_motion_and_average_the_noise() -> None:
    rng = np.random.default_rng(5)
    grid = Grid(0.005, 4001)
    at = grid.step * np.arange(grid.nodes)
    time = np.arange(0.0, grid.duration, 0.001) + 0.0003

    def force(t: np.ndarray) -> np.ndarray:
        return np.stack([np.sin(2.0 * np.pi * 2.0 * t), np.cos(2.0 * np.pi * 0.9 * t)], axis=1)

    clean = node_values(grid, time, force(time))
    assert np.max(np.abs(clean - force(at))[5:-5]) < 5e-4
    noise = rng.normal(size=(time.size, 2))
    noisy = node_values(grid, time, noise)
    # Five samples an interval: as much noise in every low frequency as the samples have
    kernel = np.ones(200) / 200.0
    low = np.convolve(noisy[:, 0], kernel, "valid")[::200]
    assert np.std(low) == pytest.approx(1.0 / np.sqrt(1000.0), rel=0.4)
    np.testing.assert_allclose(node_values(grid, time, force(time) + noise), clean + noisy, atol=1e-10)


def test_a_smoothed_swing_and_its_derivatives() -> None:
    grid = Grid(0.005, 2001)
    at = grid.step * np.arange(grid.nodes)[:, None]
    smooth = smoothed_input(grid.step, np.sin(2.0 * np.pi * 1.0 * at), WIDTHS[0])
    expected = 2.0 * np.pi * np.cos(2.0 * np.pi * at)
    np.testing.assert_allclose(smooth.at(0.0, 1)[20:-20], expected[20:-20], atol=0.001 * 2.0 * np.pi)
    expected = -((2.0 * np.pi) ** 2) * np.sin(2.0 * np.pi * at)
    np.testing.assert_allclose(smooth.at(0.0, 2)[20:-20], expected[20:-20], atol=0.002 * (2.0 * np.pi) ** 2)


def test_rate_of_noise_has_the_variance_that_is_told() -> None:
    grid = Grid(0.01, 40000)
    noise = np.random.default_rng(5).normal(size=(grid.nodes, 1))
    rate = smoothed_input(grid.step, noise, WIDTHS[0]).at(0.0, 1)
    # 40000 nodes hold some 6000 that do not depend on each other: 4 standard deviations of a variance
    assert np.var(rate) == pytest.approx(rate_noise(grid.step, WIDTHS[0]), rel=0.07)


@pytest.mark.parametrize("late", [-0.08, -0.026, 0.003, 0.05])
@pytest.mark.parametrize("piece", [(0, 600), (100, 300)])
def test_a_late_input_is_moved_by_all_of_it(late: float, piece: tuple[int, int]) -> None:
    """Where samples tell of it: of a second-order expansion 80 ms at 3 Hz leave half the amplitude."""
    grid = Grid(0.01, 601)
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 6.0, 0.0025)

    def force(at: np.ndarray) -> np.ndarray:
        return np.sin(2.0 * np.pi * 3.0 * at)[:, None]

    moved = node_input(grid, time, force(time) + 0.001 * rng.normal(size=(time.size, 1)), 0.001)
    values, middle, rate, bend = moved.between(*piece).late_by(late)
    nodes = 0.01 * np.arange(piece[0], piece[1] + 1) + late
    known = (nodes > 0.05) & (nodes < 5.92)
    np.testing.assert_allclose(values[known], force(nodes)[known], atol=0.006)
    halfway = force(nodes + 0.005) - 0.5 * (force(nodes) + force(nodes + 0.01))
    np.testing.assert_allclose(middle[known], halfway[known], atol=0.002)
    step = 1e-4
    slope = (moved.between(*piece).late_by(late + step)[0] - values) / step
    np.testing.assert_allclose(rate + 0.5 * step * bend, slope, atol=0.02)


@pytest.mark.parametrize("shape", ["blow", "swing"])
def test_a_blow_is_moved_by_all_of_it_and_a_swing_by_little_of_its_noise(shape: str) -> None:
    """A hammer's force has half its power above 10 Hz: moved below that alone it errs by 1 N of 90."""
    grid = Grid(0.005, 801)
    rng = np.random.default_rng(11)
    time = np.arange(0.0, 4.0, 0.001)

    def force(at: np.ndarray) -> np.ndarray:
        if shape == "swing":
            return 90.0 * np.sin(2.0 * np.pi * 1.5 * at)[:, None]
        phase = (at[:, None] - np.array([0.513, 1.602, 2.907])) / 0.04
        return 90.0 * np.sum(np.sin(np.pi * phase) * ((phase > 0.0) & (phase < 1.0)), axis=1, keepdims=True)

    noise = 0.3
    moved = node_input(grid, time, force(time) + noise * rng.normal(size=(time.size, 1)), noise)
    still = node_input(grid, time, force(time), noise)
    nodes = grid.step * np.arange(grid.nodes)
    inner = slice(10, -10)
    due = (force(nodes + 1e-3) - force(nodes))[inner]
    off = (still.late_by(1e-3)[0] - still.late_by(0.0)[0])[inner] - due
    # What is left is the kinks', at which a blow begins and ends
    assert np.std(off) < (0.3 if shape == "blow" else 0.001) * np.std(due)
    assert moved.rate_noise == pytest.approx(rate_noise(grid.step, WIDTHS[0 if shape == "swing" else -2]))


@pytest.mark.parametrize(("step", "samples"), [(0.05, 400), (0.005, 10)])
def test_wide_nodes_and_few_samples_are_smoothed_widely(step: float, samples: int) -> None:
    time = step * np.arange(samples)
    force = 90.0 * np.sign(np.sin(7.0 * time))[:, None]
    made = node_input(Grid(step, samples), time, force, 0.3)
    assert made.rate_noise == pytest.approx(rate_noise(step, WIDTHS[0]))
    assert np.all(np.isfinite(made.late_by(1e-3)[0]))


@pytest.mark.parametrize("rate", [200.0, 500.0])
def test_the_noise_of_an_input_reaches_a_group_by_way_of_nodes(rate: float) -> None:
    """What is claimed of it is what noise itself does."""
    grid = Grid(0.01, 2001)
    time = np.arange(0.0, 20.0, 1.0 / rate)
    heard = np.arange(0.001, 19.99, 0.0025)
    group, node = group_by_node(grid, heard)
    sampler = Sampler(grid, heard, group, node.size)
    noise = np.random.default_rng(3).normal(size=(time.size, 1))
    groups = sampler.at(0.0)[0] @ node_input(grid, time, noise, 1.0).values
    of_interval = 1.0 / np.sqrt(rate * grid.step)
    (found,) = noise_felt(grid, time, [sampler])
    assert found == pytest.approx(float(np.std(groups)) / of_interval, rel=0.05)
    assert 0.5 < found < 1.0


@pytest.mark.parametrize("std", [1e-4, 0.5, 20.0])
def test_noise_is_told_from_motion(std: float) -> None:
    rng = np.random.default_rng(2)
    time = 0.005 * np.arange(4000)
    motion = 500.0 * std * np.sin(2.0 * np.pi * 0.7 * time)
    found = sample_noise_std(time, (motion + std * rng.normal(size=time.size))[:, None])
    assert found[0] == pytest.approx(std, rel=0.06)


@pytest.mark.parametrize("frequency", [0.5, 3.0, 12.0])
def test_a_swing_has_no_jumps(frequency: float) -> None:
    rng = np.random.default_rng(4)
    grid = Grid(0.005, 1001)
    time = np.arange(0.0, grid.duration, 0.0025)
    swing = 800.0 * np.sin(2.0 * np.pi * frequency * time) + rng.normal(0.0, 0.5, time.size)
    assert not np.any(jumps_of(node_values(grid, time, swing[:, None]), 0.5))


def test_a_step_is_found_and_where() -> None:
    rng = np.random.default_rng(4)
    grid = Grid(0.005, 1001)
    time = np.arange(0.0, grid.duration, 0.0025)
    force = 800.0 * np.sin(np.pi * time) + 300.0 * (time > 2.5012) + rng.normal(0.0, 0.5, time.size)
    jumps = jumps_of(node_values(grid, time, force[:, None]), 0.5)
    assert np.all(np.abs(grid.step * np.flatnonzero(jumps) - 2.5) <= 3.0 * grid.step)
    assert np.sum(jumps) == pytest.approx(300.0, rel=0.15)


def test_what_rings_away_at_the_start_is_not_followed_though_it_is_little_of_the_run() -> None:
    time, noise, step = np.arange(0.02, 32.0, 0.002), np.array([1.0]), 0.01
    white = np.random.default_rng(4).normal(0.0, 1.0, (time.size, 1))
    swing = (1e3 * np.sin(2.0 * np.pi * 1.3 * time))[:, None]
    ringing = (200.0 * np.exp(-time / 0.7) * np.cos(2.0 * np.pi * 16.0 * time))[:, None]
    assert np.all(worst_cubic_error(time, swing + white, noise, step) < 0.8)
    assert np.all(cubic_error(time, swing + ringing + white, noise, step) < 0.1)
    told = worst_cubic_error(time, swing + ringing + white, noise, step)
    assert np.all(told > 1.0)
    # What a cubic between nodes makes of the ring itself, in its first second, is within a factor of that
    between = Sampler(Grid(step, 3201), time, np.arange(time.size), time.size).at()[0]
    nodes = step * np.arange(3201)
    ring = 200.0 * np.exp(-nodes / 0.7) * np.cos(2.0 * np.pi * 16.0 * nodes)
    first = time < 1.0
    missed = np.sqrt(np.mean((between @ ring - ringing[:, 0])[first] ** 2))
    assert 0.3 * missed < float(told[0]) < 3.0 * missed
