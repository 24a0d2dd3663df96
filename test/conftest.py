"""A session and its identification as report and command line see them: synthetic, no physics claimed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

# As the command does (cli/main.py), before anything imports numpy: two workers whose linear algebra shares
# the cores among itself take half as long again.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pytest

from rig_identification.recording import ChannelQuality, Dummy, Recording, Series, Session
from rig_identification.result import (
    ChannelFit,
    Finding,
    Identification,
    InertialEstimate,
    Mismatch,
    ParameterEstimate,
)
from rig_identification.rig import Cable, CarryingFrame, Mount, Rig

LEVEL = np.array([0.0, 0.0, 0.0, 1.0])

#: Files of long tests that share no fixture: any worker may take any of them.
FREELY_SPREAD = {"test_estimate_fit", "test_model_agreement", "test_model_conservation"}


#: An answer to a short session, whose forward model is compiled for it and kept beside the package.
COMPILED_ONCE = """
import numpy as np
from test_simulate_identify import shaken

from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session

identify(simulate_session(shaken(14), np.random.default_rng(1))[0])
"""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile once for all workers and nodes: each would for itself, minutes long and all at once."""
    alone = not session.config.getoption("numprocesses", None)
    if alone or hasattr(session.config, "workerinput") or session.config.option.collectonly:
        return
    here = Path(__file__).parent
    subprocess.run([sys.executable, "-c", COMPILED_ONCE], cwd=here, check=False)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Keep together, in one of several workers, what shares a slow fixture, and all live nodes.

    Nodes talk in real time: two graphs at once on a small machine would starve each other.
    By file, not by ``xdist_group`` marks: pytest 9.2 keeps test ids elsewhere, and pytest-xdist 3.8 then
    drops every mark without a word.
    """
    if config.getvalue("dist") != "loadgroup":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            name = Path(nodeid.partition("::")[0]).stem
            if name in FREELY_SPREAD:
                return nodeid
            return "nodes" if name.startswith("test_nodes") else name

    return ByFile(config, log)


@pytest.fixture
def rig() -> Rig:
    """Four cables, a carrying frame and every device."""
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]])
    cables = tuple(
        Cable(
            name=f"cable_{i + 1}",
            ceiling_point=np.array([0.15 * (x - 2.0) + x, 0.15 * (y - 1.0) + y, 4.0]),
            body_point=np.array([x, y, 1.4]),
            length=2.5,
        )
        for i, (x, y) in enumerate(corners)
    )
    return Rig(
        gravity=9.80665,
        cables=cables,
        mass=1240.0,
        mass_std=0.5,
        frame=CarryingFrame(168.0, np.array([1.9, 1.0, 0.9]), np.diag([90.0, 210.0, 260.0])),
        imu=Mount(np.array([1.0, 1.2, 0.4]), LEVEL),
        inclinometer=Mount(np.zeros(3), LEVEL),
        exciter=Mount(np.array([0.3, 1.0, 0.1]), LEVEL),
    )


def _quality(topic: str, rate: float, duration: float, **found: object) -> ChannelQuality:
    count = int(rate * duration)
    fields = {
        "gaps": 0,
        "missing": 0,
        "longest_gap": 0.0,
        "duplicated": 0,
        "backward": 0,
        "not_finite": 0,
        "clipped": 0,
    }
    return ChannelQuality(
        topic=topic, count=count, used=count, rate=rate, start=0.0, end=duration, **{**fields, **found}
    )


@pytest.fixture
def session(rig: Rig) -> Session:
    """Two recordings at rest, one to fit, one held out."""
    start = 1_700_000_000_000_000_000
    clean = (_quality("/rig/imu/data_raw", 200.0, 40.0), _quality("/rig/cable_1/wrench", 200.0, 40.0))
    flawed = _quality(
        "/rig/imu/data_raw",
        199.8,
        36.0,
        gaps=2,
        missing=31,
        longest_gap=0.08,
        duplicated=1,
        notes=("/rig/imu/data_raw: 31 samples are missing in 2 gaps; they are left out.",),
    )
    samples = Series(np.linspace(0.0, 1.0, 5), np.zeros((5, 1)))
    tension = {cable.name: samples for cable in rig.cables}
    dummy = Dummy(50.0, np.array([0.3, 0.2, 0.1]))
    return Session(
        name="van_2026_03",
        rig=rig,
        recordings=(
            Recording("static_bare", "static", False, start, 20.0, tension=tension, quality=clean),
            Recording("static_dummy", "static", False, start, 20.0, dummy, tension=tension, quality=clean),
            Recording("run_1", "dynamic", False, start, 40.0, tension=tension, imu=samples, quality=clean),
            Recording("run_2", "dynamic", True, start, 36.0, tension=tension, imu=samples, quality=(flawed,)),
        ),
    )


def make_channel(
    recording: str,
    channel: str,
    quantity: str,
    axis: str | None,
    unit: str,
    noise: float,
    amplitude: float,
    seed: int,
) -> ChannelFit:
    """A decaying swing with white noise and, for one seed in five, a slow error beside it."""
    rng = np.random.default_rng(seed)
    static = recording.startswith("static")
    time = np.arange(0.0, 20.0 if static else 40.0, 0.005)
    swing = np.exp(-time / 40.0) * np.sin(2.0 * np.pi * 0.55 * time + seed) + 0.2 * np.sin(
        2.0 * np.pi * 2.1 * time
    )
    predicted = 3000.0 * (unit == "N") + amplitude * (0.0 if static else 1.0) * swing
    slow = 1.5 * noise * np.sin(2.0 * np.pi * 0.55 * time) * (seed % 5 == 1 and not static)
    measured = predicted + noise * rng.standard_normal(len(time)) + slow
    return ChannelFit(
        recording, channel, quantity, axis, unit, noise, seed % 2 == 0, time, measured, np.asarray(predicted)
    )


def make_channels() -> tuple[ChannelFit, ...]:
    """Load cells everywhere, IMU and inclinometer where the body moves."""
    fits = []
    for recording in ("static_bare", "static_dummy", "run_1", "run_2"):
        for i in range(4):
            seed = len(fits)
            fits.append(make_channel(recording, f"cable_{i + 1}", "tension", None, "N", 2.0, 160.0, seed))
        if recording.startswith("run"):
            for axis in "xyz":
                seed = len(fits)
                fits.append(make_channel(recording, "imu", "angular_rate", axis, "rad/s", 3e-4, 0.03, seed))
            for axis in "xyz":
                seed = len(fits)
                fits.append(make_channel(recording, "imu", "specific_force", axis, "m/s^2", 0.01, 0.5, seed))
            for axis in "xy":
                seed = len(fits)
                fits.append(
                    make_channel(recording, "inclinometer", "inclination", axis, "rad", 3e-4, 0.01, seed)
                )
    return tuple(fits)


def make_parameters() -> tuple[ParameterEstimate, ...]:
    """Doubts about the rig, one of them far off its description."""
    rng = np.random.default_rng(7)
    parameters = []
    for i in range(1, 5):
        for name, unit, nominal, prior in (
            ("length", "m", 2.5, 5e-4),
            ("load_cell_gain", "1", 1.0, 5e-4),
            ("load_cell_zero", "N", 0.0, 3.0),
        ):
            narrowed = prior * rng.uniform(0.2, 1.0)
            value = nominal + prior * rng.standard_normal()
            parameters.append(ParameterEstimate(f"cable_{i}.{name}", unit, nominal, prior, value, narrowed))
    parameters.append(ParameterEstimate("imu.accelerometer_bias.x", "m/s^2", 0.0, 0.02, 0.074, 0.001))
    parameters.append(ParameterEstimate("clock.imu", "s", 0.0, np.inf, 0.0021, 1e-5))
    return tuple(parameters)


def make_estimate(unobservable: tuple[str, ...] = (), *, mass: float = 1240.13) -> InertialEstimate:
    """A van of 1240 kg with a positive definite covariance."""
    values = np.array([mass, 1.9312, 1.0127, 0.6521, 372.4, -14.21, 31.7, 1651.3, 5.42, 1784.9])
    std = np.array([0.4, 4e-4, 3e-4, 6e-4, 0.9, 0.5, 0.7, 2.1, 0.6, 2.4])
    mixing = np.eye(10) + 0.2 * np.random.default_rng(3).standard_normal((10, 10))
    covariance = mixing @ mixing.T
    scale = std / np.sqrt(np.diag(covariance))
    return InertialEstimate(values, covariance * np.outer(scale, scale), unobservable)


def make_finding() -> Finding:
    """A finding with every field that the contract knows."""
    return Finding(
        effect="cable_elasticity",
        where={
            "channel": "cable_3",
            "axis": None,
            "position": np.array([1.0, 0.0, -0.6]),
            "times": [{"recording": "run_1", "start": 3.2, "end": 5.1}],
        },
        parameters={"axial_stiffness": {"value": np.float64(4.1e6), "std": 2e4, "unit": "N"}},
        evidence={"log_likelihood_gain": 812.0, "holdout_error_before": 3.1, "holdout_error_after": 1.02},
        statement="The cables stretch: loaded, cable_3 is 2.3 mm longer. Describe its stiffness.",
    )


@pytest.fixture
def identification() -> Identification:
    """Everything determined, the ideal model holds."""
    return Identification(
        total=make_estimate(),
        without_frame=make_estimate(mass=1072.13),
        mismatch=Mismatch(
            "none", "No residual differs from white noise of the stated size at the 1 % level."
        ),
        parameters=make_parameters(),
        channels=make_channels(),
        holdout_error=1.03,
        training_error=1.01,
        converged=True,
        notes=("The first 1.2 s of run_2 are left out: a person still holds the body.",),
    )


@pytest.fixture
def explained() -> Identification:
    """A finding, an alternative, and an element that no recording shows."""
    total = make_estimate(("Jzz",))
    return Identification(
        total=total,
        without_frame=None,
        mismatch=Mismatch(
            "explained",
            "Elastic cables bring the held-out error from 3.1 to 1.02.",
            findings=(make_finding(),),
            alternatives=({"effect": "ceiling_compliance", "log_likelihood_gap": 2.3},),
        ),
        parameters=(),
        channels=make_channels()[8:12],
        holdout_error=None,
        training_error=1.02,
        converged=False,
    )
