"""A description that calls a sensor quieter than it is, and what lies under a signal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_samples import make_rig

from rig_identification.estimate.noise import noise_std, white_floor

TIME = np.arange(4000) / 200.0


def signals() -> dict[str, np.ndarray]:
    """Motion that comes beside noise of standard deviation 1."""
    swing = 500.0 * np.sin(2.0 * np.pi * 0.4 * TIME) + 200.0 * np.sin(2.0 * np.pi * 2.1 * TIME)
    ring = 300.0 * np.exp(-0.2 * TIME) * np.sin(2.0 * np.pi * 31.0 * TIME)
    snap = np.where((TIME % 7.0) < 0.05, 400.0, 0.0)
    hum = 50.0 * np.sin(2.0 * np.pi * 50.0 * TIME)
    return {
        "rest": 0.0 * TIME,
        "swing": swing,
        "ring": swing + ring,
        "snap": swing + snap,
        "hum": swing + hum,
    }


@pytest.mark.parametrize("name", signals())
def test_the_floor_is_the_noise_whatever_moves(name: str) -> None:
    noise = np.random.default_rng(3).normal(size=TIME.size)
    assert white_floor(TIME, (signals()[name] + noise)[:, None])[0] == pytest.approx(1.0, rel=0.15)


def test_too_few_samples_tell_no_floor() -> None:
    assert white_floor(TIME[:300], np.random.default_rng(3).normal(size=(300, 2))).tolist() == [0.0, 0.0]


def test_motion_across_missing_samples_is_no_noise() -> None:
    rng = np.random.default_rng(6)
    kept = rng.random(TIME.size) > 0.2
    values = (signals()["swing"] + rng.normal(size=TIME.size))[kept][:, None]
    std, estimated = noise_std(replace(make_rig(), noise={"tension": 1.0}), "tension", TIME[kept], values)
    assert std.tolist() == [1.0]
    assert not estimated
    slow = (np.sin(2.0 * np.pi * TIME) * 100.0 + rng.normal(size=TIME.size))[kept][:, None]
    assert noise_std(replace(make_rig(), noise={}), "tension", TIME[kept], slow)[0] == pytest.approx(
        1.0, rel=0.1
    )


@pytest.mark.parametrize(("described", "used"), [(0.33, 1.0), (1.0, 1.0), (3.0, 3.0)])
def test_samples_are_believed_where_they_scatter_more(described: float, used: float) -> None:
    values = (signals()["swing"] + np.random.default_rng(4).normal(size=TIME.size))[:, None]
    rig = replace(make_rig(), noise={"tension": described})
    std, estimated = noise_std(rig, "tension", TIME, values)
    assert std[0] == pytest.approx(used, rel=0.1)
    assert estimated == (described < used)


@pytest.mark.parametrize("rate", [50, 200, 1000])
def test_a_noise_that_is_not_described_is_found_at_any_rate(rate: int) -> None:
    time = np.arange(20 * rate) / rate
    swing = 300.0 * np.sin(2.0 * np.pi * 2.1 * time)
    values = (swing + np.random.default_rng(5).normal(size=time.size))[:, None]
    std, estimated = noise_std(replace(make_rig(), noise={}), "tension", time, values)
    assert std[0] == pytest.approx(1.0, rel=0.15)
    assert estimated


@pytest.mark.parametrize("count", [1, 2, 127, 300])
def test_few_samples_have_no_floor(count: int) -> None:
    values = np.random.default_rng(0).standard_normal((count, 3))
    assert white_floor(np.arange(count) / 100.0, values).tolist() == [0.0, 0.0, 0.0]
