"""Sessions with one or two things left out: what an answer has to name of them, and where."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_estimate_launch import tilted_trifilar
from test_simulate_identify import shaken
from wrong_sessions import (
    biased,
    hinge_drawn_aside,
    imu_drawn_lower,
    lagging,
    late_cell,
    made,
    made_twice,
    moved,
    turned_imu,
    twice,
    wrong,
)

from rig_identification.recording import Recording, Session
from rig_identification.result import Finding
from rig_identification.search.identify import identify
from rig_identification.simulate import simulate_session
from rig_identification.simulate.exciter import UnbalancedMass
from rig_identification.simulate.start import Pulled

#: What is asked of a finding: channel, axis and first number; None where any will do.
Told = tuple[str | None, str | None, float | None]
ANY: Told = (None, None, None)


@dataclass(frozen=True)
class Scenario:
    """A session with something left out, and what an answer has to name."""

    make: Callable[[], Session]
    told: dict[str, Told] = field(default_factory=dict)  # by effect, or by several of which one is told
    pushed: tuple[str, float, float] | None = None  # recording, start and end (s) of a push


def every(session: Session, change: Callable[[Recording], Recording]) -> Session:
    """The session with each recording changed."""
    return replace(session, recordings=tuple(change(r) for r in session.recordings))


def pushed(
    number: int,
    seconds: float,
    held: float,
    seed: int,
    push: tuple[str, float, float, float],
    effects: dict[str, tuple[float, ...]] | None = None,
    bias: float = 0.0,
) -> Session:
    """A session in one run of which something pushes: recording, N at the peak, start and duration (s)."""
    spec = replace(twice(shaken(number, seconds), held), effects=effects or {})
    session = simulate_session(spec, np.random.default_rng(seed))[0]
    run, *course = push
    session = every(session, lambda r: moved(r, *course) if r.name == run else r)
    return every(session, lambda r: biased(r, bias))


def hose_that_a_held_out_run_shows() -> Session:
    """Shaken at one frequency; held out, pulled aside and let go, which shows a spring of 600 N/m."""
    spec = shaken(10, 12.0)
    weight, at = float(spec.elements[0]) * spec.rig.gravity, spec.elements[1:4]
    motor = UnbalancedMass(0.03 * weight / (2.0 * np.pi * 1.1) ** 2, 1.1, ramp=2.0)
    pull = Pulled(0.1 * weight * np.array([0.1, 1.0, 0.0]), at + np.array([0.6, 0.1, 0.0]))
    shaking = replace(spec.runs[0], force=motor)
    free = replace(spec.runs[0], name="run_2", holdout=True, start=pull, force=None)
    hose = {"tether": (0.0, 600.0, 0.0), "tether_point": (1.0, 2.0, -0.5)}
    spec = replace(spec, runs=(shaking, free), effects=hose)
    return simulate_session(spec, np.random.default_rng(2))[0]


def hinge_of_a_trifilar_and_an_inclinometer() -> Session:
    """Of three parallel cables one upper hinge drawn too high by 20 mm, and an inclinometer off 10 mrad."""
    session = tilted_trifilar()
    assert session.rig.inclinometer is not None
    turned = replace(session.rig.inclinometer, orientation=Rotation.from_rotvec([0.0, -0.01, 0.0]).as_quat())
    *others, last = session.rig.cables
    last = replace(last, ceiling_point=last.ceiling_point + np.array([0.0, 0.0, 0.015]))
    return replace(session, rig=replace(session.rig, inclinometer=turned, cables=(*others, last)))


def yielding(stiffness: float, mass: float) -> dict[str, tuple[float, ...]]:
    """A ceiling of so many N/m and kg."""
    return {"ceiling_compliance.stiffness": (0.0, 0.0, stiffness), "ceiling_compliance.mass": (mass,)}


def liquid(
    mass: float, frequency: float, ratio: float, at: tuple[float, ...]
) -> dict[str, tuple[float, ...]]:
    """A tank: kg, Hz, damping ratio, m."""
    return {
        "liquid_slosh.mass": (mass,),
        "liquid_slosh.frequency": (frequency,),
        "liquid_slosh.damping_ratio": (ratio,),
        "liquid_slosh.position": at,
    }


RAISED = {"hinge_position.ceiling": tuple(np.array([[0.0, 0.0, 0.007], *[[0.0] * 3] * 3]).ravel())}
STRETCH = {"cable_elasticity": (6e6,), "cable_damping_ratio": (0.02,)}
PULL = {"tether": (0.0, 20.0, 0.0), "tether_pull": (0.0, 40.0, 0.0), "tether_point": (0.7, 0.9, -0.8)}
BRAKE = {"point_law.brake": (60.0, 0.0), "point_law.position": (0.2, 0.4, -0.3)}

SCENARIOS: dict[str, Scenario] = {
    "gyroscope_and_dry_hinges": Scenario(
        lambda: every(made(10, 12.0, 4, {"hinge_friction": (4.0,)}, doubts=True), lambda r: biased(r, 0.012)),
        {"imu_bias": ("imu", "x", 0.012), "hinge_friction": (None, None, 4.0)},
    ),
    "clock_and_inclinometer": Scenario(
        lambda: made_twice(10, 10.0, 5, {"imu.clock": (0.05,), "inclinometer.orientation.x": (0.01,)}),
        {"clock_offset": ("imu", None, None), "inclinometer_offset": ("inclinometer", None, None)},
    ),
    "rotor_and_push": Scenario(
        lambda: pushed(12, 16.0, 12.0, 8, ("run_1", 150.0, 9.0, 1.2), {"exciter_rotor": (28.0,)}),
        {"exciter_rotor": (None, None, 28.0)},
        ("run_1", 9.0, 10.2),
    ),
    "gyroscope_and_push": Scenario(
        lambda: pushed(14, 24.0, 12.0, 8, ("run_1", 120.0, 14.0, 1.2), bias=0.012),
        {"imu_bias": ("imu", "x", 0.012)},
        ("run_1", 14.0, 15.2),
    ),
    "gentle_push_in_a_fitted_run_and_gyroscope": Scenario(
        lambda: pushed(14, 20.0, 16.0, 11, ("run_1", 4.0, 9.0, 0.8), bias=0.006),
        {"imu_bias": ("imu", "x", None)},
        ("run_1", 9.0, 9.8),
    ),
    "gentle_push_in_a_held_out_run_and_gyroscope": Scenario(
        lambda: pushed(14, 20.0, 16.0, 11, ("run_2", 25.0, 9.0, 0.8), bias=0.012),
        {"imu_bias": ("imu", "x", None)},
        ("run_2", 9.0, 9.8),
    ),
    "cable_too_long": Scenario(
        lambda: made(10, 6.0, 2, {"cable_length": (0.0, 0.0, 0.02, 0.0)}),
        {"cable_length": ("cable_3", None, None)},
    ),
    "ceiling_and_imu_off_its_place": Scenario(
        lambda: imu_drawn_lower(made(14, 10.0, 4, yielding(4e5, 80.0)), 0.08),
        {"ceiling_compliance": ("ceiling", "z", None), "imu_position": ("imu", None, None)},
    ),
    "ceiling_and_late_cell": Scenario(
        lambda: every(made(14, 10.0, 4, yielding(3e6, 800.0)), lambda r: late_cell(r, 0.0123)),
        {"ceiling_compliance": ("ceiling", "z", None), "clock_offset": ("cable_1", None, None)},
    ),
    "liquid_and_stretching_cables": Scenario(
        lambda: made(14, 10.0, 4, STRETCH | liquid(15.0, 1.1, 0.03, (1.2, 1.0, -0.8))),
        {"cable_elasticity": (None, None, 6e6), "liquid_slosh": (None, None, 15.0)},
    ),
    "turned_imu_and_liquid": Scenario(
        lambda: every(
            made(14, 6.0, 2, liquid(20.0, 0.9, 0.01, (0.9, 2.0, -0.6))), lambda r: turned_imu(r, 0.05)
        ),
        {"imu_misalignment": ("imu", None, None), "liquid_slosh": (None, None, 20.0)},
    ),
    "hinge_damping_and_no_friction": Scenario(
        lambda: made_twice(10, 10.0, 5, {"hinge_damping": (1.0,)}), {"hinge_damping": (None, None, 1.0)}
    ),
    "strong_hinge_damping_and_no_air": Scenario(
        lambda: made_twice(10, 10.0, 5, {"hinge_damping": (30.0,)}), {"hinge_damping": (None, None, 30.0)}
    ),
    "hose_that_pulls": Scenario(lambda: made(12, 12.0, 4, PULL, doubts=True), {"tether": (None, "y", None)}),
    "hose_that_a_held_out_run_shows": Scenario(
        hose_that_a_held_out_run_shows, {"tether": (None, "y", 600.0)}
    ),
    "inclinometer_and_cell": Scenario(
        lambda: every(made(14, 12.0, 5, doubts=True), lambda r: wrong(r, 0.004, 40.0)),
        {"inclinometer_offset": ("inclinometer", None, None), "load_cell_offset": ("cable_1", None, None)},
    ),
    "brake_and_no_liquid": Scenario(lambda: made_twice(14, 12.0, 3, BRAKE), {"unknown": (None, None, 60.0)}),
    "tilted_ceiling_and_turned_imu": Scenario(
        lambda: every(made(10, 12.0, 2, {"level_error": (0.0, 0.02)}), lambda r: turned_imu(r, 0.033)),
        {"level_error": ("ceiling", None, None), "imu_misalignment": ("imu", None, None)},
    ),
    "rotor_and_hinges": Scenario(
        lambda: made(10, 6.0, 3, {"exciter_rotor": (25.0,), "hinge_damping": (300.0,)}),
        {"exciter_rotor": (None, None, 25.0), "hinge_damping": (None, None, 300.0)},
    ),
    "cell_and_hinges": Scenario(
        lambda: made_twice(10, 10.0, 5, {"cable_1.load_cell_gain": (0.02,), "hinge_damping": (1.0,)}),
        {"load_cell_gain": ("cable_1", None, None), "hinge_damping": (None, None, 1.0)},
    ),
    "cell_that_lags": Scenario(
        lambda: every(made(10, 12.0, 4, doubts=True), lambda r: lagging(r, 0.05)),
        {"sensor_lag": ("cable_1", None, 0.05)},
    ),
    "hinge_aside": Scenario(
        lambda: hinge_drawn_aside(made(14, 10.0, 4), 0.018), {"hinge_position": ("cable_2", "y", None)}
    ),
    "hinge_higher": Scenario(lambda: made(10, 10.0, 2, RAISED), {"hinge_position": ("cable_1", "z", None)}),
    "hinge_of_a_trifilar_and_inclinometer": Scenario(
        hinge_of_a_trifilar_and_an_inclinometer,
        {
            "inclinometer_offset": ("inclinometer", None, None),
            "hinge_position or level_error or cable_length": ANY,
        },
    ),
    "dry_hinges_and_cable_too_long": Scenario(
        lambda: made(14, 4.0, 4, {"hinge_friction": (4.0,), "cable_length": (0.0, 0.0, 0.02, 0.0)}),
        {"hinge_friction": (None, None, 4.0), "cable_length or hinge_position": ANY},
    ),
    "soft_cables": Scenario(
        lambda: made(10, 4.0, 5, {"cable_elasticity": (3e5,), "cable_damping_ratio": (0.02,)}),
        {"cable_elasticity": (None, None, 3e5)},
    ),
}


def number(finding: Finding) -> tuple[float, float]:
    """A finding's first number, and its std."""
    first = next(iter(finding.parameters.values()))
    return float(first["value"]), float(first["std"])


def assert_told(finding: Finding, told: Told) -> None:
    """The place is right, and the first number within four std and a twentieth."""
    channel, axis, value = told
    if channel is not None:
        assert finding.where["channel"] == channel
    if axis is not None:
        assert finding.where["axis"] == axis
    if value is not None:
        found, std = number(finding)
        assert abs(found - value) < 4.0 * std + 0.05 * abs(value)


def assert_pushed(finding: Finding, recording: str, start: float, end: float) -> None:
    """The push is told in its recording, at a time that overlaps its own."""
    (times,) = finding.where["times"]  # type: ignore[misc]
    assert times["recording"] == recording
    assert times["start"] < end
    assert times["end"] > start


#: Those that the gate runs: two devices, and one number of the rig. A law stands in test_search_laws.py, an
#: event in test_mismatch_pulse.py, a hose in test_mismatch_steady_pull.py.
QUICK = {
    "cable_too_long",
    "inclinometer_and_cell",
}
#: Those that do not come out, and what came instead.
OTHERWISE: dict[str, str] = {}


def cases() -> list[object]:
    """The scenarios; all but a few are long."""
    out = []
    for name, scenario in SCENARIOS.items():
        marks = [] if name in QUICK else [pytest.mark.long]
        if name in OTHERWISE:
            marks.append(pytest.mark.xfail(strict=False, reason=OTHERWISE[name]))
        out.append(pytest.param(scenario, id=name, marks=marks))
    return out


@pytest.mark.parametrize("scenario", cases())
def test_what_is_left_out_is_named(scenario: Scenario) -> None:
    found = identify(scenario.make())
    mismatch = found.mismatch
    named = {f.effect: f for f in mismatch.findings}
    assert mismatch.verdict == "explained", mismatch.explanation
    assert len(named) == len(mismatch.findings)
    push = named.pop("external_force", None)
    assert (push is not None) is (scenario.pushed is not None)
    if push is not None and scenario.pushed is not None:
        assert_pushed(push, *scenario.pushed)
    for effects, told in scenario.told.items():
        # What is alike to first order is as right
        (effect,) = set(effects.split(" or ")) & set(named)
        assert_told(named.pop(effect), told)
    assert not named
    assert found.holdout_error is None or found.holdout_error < 1.1
