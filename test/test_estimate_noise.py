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
    assert white_floor((signals()[name] + noise)[:, None])[0] == pytest.approx(1.0, rel=0.15)


def test_too_few_samples_tell_no_floor() -> None:
    assert white_floor(np.random.default_rng(3).normal(size=(300, 2))).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("described", "used"), [(0.33, 1.0), (1.0, 1.0), (3.0, 3.0)])
def test_samples_are_believed_where_they_scatter_more(described: float, used: float) -> None:
    values = (signals()["swing"] + np.random.default_rng(4).normal(size=TIME.size))[:, None]
    rig = replace(make_rig(), noise={"tension": described})
    std, estimated = noise_std(rig, "tension", TIME, values)
    assert std[0] == pytest.approx(used, rel=0.1)
    assert estimated == (described < used)
