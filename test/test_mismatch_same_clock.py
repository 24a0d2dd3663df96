"""A clock that is off is off the grid on which it would be stamped with the others."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.mismatch.same_clock import contradicted, shared_interval
from rig_identification.recording import Recording, Series
from rig_identification.session import read_session

FOLDER = Path(
    os.environ.get(
        "RIG_IDENTIFICATION_RECORDINGS", Path(__file__).resolve().parents[2] / "shared" / "recordings"
    )
)
STEP, DURATION = 0.002, 12.0


def _stamps(step: float, first: float = 0.0, missing: float = 0.0) -> Series:
    time = first + np.arange(round(DURATION / step)) * step
    kept = np.random.default_rng(3).uniform(size=time.size) >= missing
    return Series(time[kept], np.zeros((int(kept.sum()), 1)))


def _recording(cells: dict[str, Series], imu: Series | None = None) -> Recording:
    return Recording("run_1", "dynamic", False, 0, DURATION, tension=cells, imu=imu)


def _late(recording: Recording, channel: str, late: float, std: float, effect: str = "clock_offset"):  # type: ignore[no-untyped-def]
    """The least that a trial of a late clock holds: its value, and how well it is known (s)."""
    own = Parameter(f"{channel}.clock", "s", 0.0, 0.05, "device", 0)
    parameters = SimpleNamespace(free=(own,), values=lambda theta: np.array([late]))
    information = np.eye(INERTIAL + 1)
    information[INERTIAL, INERTIAL] = (own.prior_std / std) ** 2
    return SimpleNamespace(
        candidate=SimpleNamespace(effect=effect, where={"channel": channel}, parameters=(own,)),
        problem=SimpleNamespace(
            runs=(SimpleNamespace(recording=recording),), bench=SimpleNamespace(parameters=parameters)
        ),
        evaluation=SimpleNamespace(
            point=SimpleNamespace(theta=np.zeros(INERTIAL + 1)), information=information
        ),
    )


@pytest.fixture(scope="module")
def together() -> Recording:
    """Two cells on one grid, with samples missing, and an IMU with a clock of its own."""
    cells = {"cable_1": _stamps(STEP, 4 * STEP, 0.05), "cable_2": _stamps(STEP)}
    return _recording(cells, _stamps(0.005, 0.0012))


def test_devices_of_one_clock_share_its_interval(together: Recording) -> None:
    assert shared_interval(together, "cable_1") == pytest.approx(STEP)
    assert shared_interval(together, "imu") is None
    assert shared_interval(together, "exciter") is None


def test_a_slower_device_lies_on_the_faster_ones_grid() -> None:
    recording = _recording({"cable_1": _stamps(STEP), "cable_2": _stamps(5 * STEP)})
    assert shared_interval(recording, "cable_2") == pytest.approx(STEP)
    drifting = _recording({"cable_1": _stamps(STEP), "cable_2": _stamps(STEP * (1.0 + 2e-6))})
    assert shared_interval(drifting, "cable_2") is None


@pytest.mark.parametrize(
    ("late", "off"), [(0.0131, True), (-0.0049, True), (0.01202, False), (-0.004, False)]
)
def test_a_clock_is_off_by_whole_intervals_or_by_none(together: Recording, late: float, off: bool) -> None:
    assert contradicted(_late(together, "cable_1", late, 1e-4)) is off
    # Known no better than an interval it may be any number of them
    assert not contradicted(_late(together, "cable_1", late, 5e-4))


def test_what_has_a_grid_of_its_own_may_be_late_by_anything(together: Recording) -> None:
    assert not contradicted(_late(together, "imu", 0.0131, 1e-4))
    assert not contradicted(_late(together, "cable_1", 0.0131, 1e-4, "sensor_lag"))
    apart = _recording({**together.tension, "cable_1": _stamps(STEP, 0.0007)})
    assert not contradicted(_late(apart, "cable_1", 0.0131, 1e-4))


@pytest.mark.skipif(
    not (FOLDER / "session_a").exists(), reason=f"no {FOLDER}: set RIG_IDENTIFICATION_RECORDINGS"
)
def test_another_engines_cells_have_one_clock_and_its_imu_another() -> None:
    run = read_session(FOLDER / "session_a").training[0]
    assert shared_interval(run, "cable_1") == pytest.approx(0.002)
    assert shared_interval(run, "imu") is None
    early = replace(run, tension={**run.tension, "cable_1": _moved(run.tension["cable_1"], -0.0131)})
    assert shared_interval(early, "cable_1") is None


def _moved(series: Series, by: float) -> Series:
    return replace(series, time=series.time + by)
