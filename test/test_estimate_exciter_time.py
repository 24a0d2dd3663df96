"""The exciter's force, seen by cells that lag or whose clock is late: what it was."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from rig_identification.estimate.parameters import DeviceLayout
from rig_identification.estimate.prediction import drive
from rig_identification.estimate.sampling import Grid, node_input

GRID = Grid(0.01, 1001)
OMEGA = 2.0 * np.pi * 2.0
TIME = GRID.step * np.arange(GRID.nodes)
INSIDE = slice(30, -30)


def driven(measured: np.ndarray, late: float = 0.0, lag: float = 0.0) -> np.ndarray:
    """(N,) force that a run's measured one tells of."""
    places = DeviceLayout(("cable_1", "cable_2"))
    own = np.zeros(places.size)
    own[places.exciter_clock], own[places.lag("exciter")] = late, lag
    force = node_input(GRID, TIME, np.tile(measured[:, None], 3), 1e-6)
    run = SimpleNamespace(grid=GRID, force=force)
    parameters = SimpleNamespace(places=places, device=lambda theta: own)
    return drive(run, parameters, np.zeros(0)).force[:, 0]  # type: ignore[arg-type]


def test_every_device_has_a_lag_of_its_own() -> None:
    places = DeviceLayout(("cable_1", "cable_2"))
    devices = ("cable_1", "cable_2", "imu", "inclinometer", "mocap", "exciter")
    entries = [*(places.lag(d) for d in devices), *(places.clock(d) for d in devices)]
    assert len(set(entries)) == len(entries)
    assert max(entries) < places.size


@pytest.mark.parametrize("tau", [0.003, 0.01, 0.02])
def test_a_low_pass_is_undone(tau: float) -> None:
    phase = np.arctan(OMEGA * tau)
    measured = np.sin(OMEGA * TIME - phase) * np.cos(phase)
    error = driven(measured, lag=tau) - np.sin(OMEGA * TIME)
    assert np.max(np.abs(error[INSIDE])) < 2e-3 * max(1.0, tau / 0.01)
    # As a late clock it would be too small by (w tau)^2 / 2
    clock = driven(measured, late=phase / OMEGA)
    assert np.max(clock[INSIDE]) == pytest.approx(np.cos(phase), abs=2e-3)


@pytest.mark.parametrize("late", [-0.015, 0.003, 0.02])
def test_a_late_clock_is_undone(late: float) -> None:
    measured = np.sin(OMEGA * (TIME - late))
    error = driven(measured, late=late) - np.sin(OMEGA * TIME)
    # To second order: (w d)^3 / 6 is left
    assert np.max(np.abs(error[INSIDE])) < 1e-3 + abs(OMEGA * late) ** 3 / 5.0
