"""Bifilar pendulums that only motion capture watches: real where this machine has them, and simulated."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.spatial.transform import Rotation

from bench.pendulums import drawn
from rig_identification.estimate.rolling import depth_of
from rig_identification.model.equilibrium import design_pose, settle
from rig_identification.model.modes import natural_modes
from rig_identification.model.motion import rig_model
from rig_identification.recording import Recording, Session
from rig_identification.result import ELEMENTS, Identification
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, Rig
from rig_identification.search.identify import identify
from rig_identification.session import read_session
from rig_identification.simulate import Posed, RunSpec, SampleRates, SessionSpec, simulate_session

FOLDER = Path(
    os.environ.get(
        "RIG_IDENTIFICATION_RECORDINGS", Path(__file__).resolve().parents[2] / "shared" / "recordings"
    )
)

#: s of wall clock that a recorded session may take.
LONGEST = 180.0


@dataclass(frozen=True)
class Answered:
    session: Session
    answer: Identification
    seconds: float


def answered(name: str) -> Answered:
    folder = FOLDER / name
    if not (folder / "session.yaml").exists():
        pytest.skip(f"no {folder}: set RIG_IDENTIFICATION_RECORDINGS to a folder of sessions")
    session = read_session(folder)
    begin = time.monotonic()
    answer = identify(session)
    return Answered(session, answer, time.monotonic() - begin)


@pytest.fixture(scope="module")
def cradle() -> Answered:
    """An empty cradle that a person sets turning about the vertical."""
    return answered("pendulum_cradle_z")


@pytest.fixture(scope="module")
def other_way() -> Answered:
    """The same cradle hung by another side."""
    return answered("pendulum_cradle_x")


def yaw_period(recording: Recording) -> float:
    """Period (s) of the yaw from its largest swing on: zero crossings, a straight line through them."""
    assert recording.mocap is not None
    turns = Rotation.from_quat(recording.mocap.values[:, 3:])
    t = recording.mocap.time
    # In the tracker's axes, whose z is up
    yaw = (turns * turns.mean().inv()).as_rotvec()[:, 2]
    free = t > t[int(np.argmax(np.abs(yaw)))]
    t, yaw = t[free], yaw[free]
    smooth = np.convolve(yaw - np.mean(yaw), np.ones(31) / 31.0, mode="same")
    rising = np.flatnonzero((smooth[:-1] < 0.0) & (smooth[1:] >= 0.0))
    crossing = t[rising] - smooth[rising] * (t[rising + 1] - t[rising]) / (
        smooth[rising + 1] - smooth[rising]
    )
    # Bursts of noise cross more than once: one crossing a swing
    crossing = crossing[np.concatenate([[True], np.diff(crossing) > 1.0])]
    assert crossing.size > 6
    (period, _), _ = curve_fit(lambda n, a, b: a * n + b, np.arange(crossing.size), crossing)
    return float(period)


def yaw_rate_amplitude(recording: Recording) -> float:
    """Root mean square amplitude (rad/s) of the yaw's rate from its largest swing on."""
    assert recording.mocap is not None
    turns = Rotation.from_quat(recording.mocap.values[:, 3:])
    yaw = (turns * turns.mean().inv()).as_rotvec()[:, 2]
    free = yaw[int(np.argmax(np.abs(yaw))) :]
    return float(np.sqrt(2.0) * np.std(free) * 2.0 * np.pi / yaw_period(recording))


def bifilar_inertia(rig: Rig, period: float) -> float:
    """J = m g D^2 / (4 h w^2)."""
    assert rig.mass is not None
    first, second = rig.cables
    distance = float(np.linalg.norm(first.body_point - second.body_point))
    rate = 2.0 * np.pi / period
    return rig.mass * rig.gravity * distance**2 / (4.0 * first.length * rate**2)


def element(answer: Identification, name: str) -> float:
    return float(answer.total.values[ELEMENTS.index(name)])


def test_vertical_inertia_agrees_with_the_bifilar_formula(cradle: Answered) -> None:
    period = float(np.mean([yaw_period(r) for r in cradle.session.recordings]))
    expected = bifilar_inertia(cradle.session.rig, period)
    assert element(cradle.answer, "Jzz") == pytest.approx(expected, rel=0.03)
    assert "Jzz" not in cradle.answer.total.unobservable
    assert "m" not in cradle.answer.total.unobservable


def test_what_a_bifilar_pendulum_cannot_tell_is_named(cradle: Answered) -> None:
    assert {"Jxx", "Jxy", "Jxz", "Jyy", "Jyz"} <= set(cradle.answer.total.unobservable)


def test_the_part_in_which_a_person_drives_is_found(cradle: Answered) -> None:
    """By eye the body is let go between 13 and 15 s in run_1, and between 11 and 13 s in run_2."""
    hand = next(f for f in cradle.answer.mismatch.findings if f.effect == "external_force")
    ends: dict[str, float] = {}
    for stretch in hand.where["times"]:  # type: ignore[attr-defined]
        ends[stretch["recording"]] = max(ends.get(stretch["recording"], 0.0), stretch["end"])
    assert 12.5 <= ends["run_1"] <= 16.5
    assert 10.5 <= ends["run_2"] <= 14.5
    assert hand.parameters["peak_force"]["value"] > 0.0  # type: ignore[operator]


def test_what_damps_it_is_found(cradle: Answered) -> None:
    dampers = [f for f in cradle.answer.mismatch.findings if f.effect in ("hinge_damping", "air_drag")]
    assert dampers
    # What hinges of c take from yaw: each of two cables is bent by D/2h of it at each end that damps and,
    # where they do not twist freely, twisted by half of it at each. Air that resists with the square of the
    # rate takes as much as a linear 8/(3 pi) of its moment at the rate's amplitude. Yaw falls by 3 % a
    # second: energy by 2 J rate w^2
    first, second = cradle.session.rig.cables
    lean = 0.5 * float(np.linalg.norm(first.body_point - second.body_point)) / first.length
    amplitude = float(np.mean([yaw_rate_amplitude(r) for r in cradle.session.recordings]))
    power, clear = 0.0, []
    for f in dampers:
        first_of_it = next(iter(f.parameters.values()))
        value = float(first_of_it["value"])  # type: ignore[arg-type]
        clear.append(value / float(first_of_it["std"]))  # type: ignore[arg-type]
        if f.effect == "hinge_damping":
            twists = "twist freely" not in f.statement
            ends = 1 if "end" in f.where else 2
            power += value * (2.0 * ends * lean**2 + (1.0 if twists else 0.0))
        elif "turning_drag" in f.parameters:
            moment = 0.5 * 1.2 * float(f.parameters["turning_drag"]["value"]) * amplitude  # type: ignore[arg-type]
            power += moment * 8.0 / (3.0 * np.pi)
    assert max(clear) > 2.0
    assert power == pytest.approx(2.0 * 0.03 * element(cradle.answer, "Jzz"), rel=0.3)
    damping = dampers[0]
    before, after = damping.evidence["holdout_error_before"], damping.evidence["holdout_error_after"]
    assert before is not None
    assert after is not None
    assert after < min(2.0, before / 3.0)


def test_the_tracker_whose_markers_hide_is_told(cradle: Answered) -> None:
    """Steps of a centimetre's fifth and of half a degree in its poses, at the same turn in every swing."""
    tracker = next(f for f in cradle.answer.mismatch.findings if f.where.get("law") == "pose error")
    assert 5e-4 < tracker.parameters["position_error"]["value"] < 4e-3  # type: ignore[operator]
    assert 2e-3 < tracker.parameters["orientation_error"]["value"] < 1.5e-2  # type: ignore[operator]


def cubic_moment(answer: Identification) -> tuple[float, float]:
    found = next(f for f in answer.mismatch.findings if "cubic_moment" in f.parameters)
    moment = found.parameters["cubic_moment"]
    return float(moment["value"]), float(moment["std"])  # type: ignore[arg-type]


def test_two_ways_to_hang_it_tell_of_the_same_air(cradle: Answered, other_way: Answered) -> None:
    """Another side up has another inertia and other hinges, but the cradle's sides and the air stay."""
    first, second = cubic_moment(cradle.answer), cubic_moment(other_way.answer)
    assert first[0] < -2.0 * first[1]
    assert second[0] < -2.0 * second[1]
    assert abs(first[0] - second[0]) < 3.0 * np.hypot(first[1], second[1])
    plates = next(f for f in other_way.answer.mismatch.findings if f.effect == "air_drag")
    area = plates.parameters["drag_area"]
    assert area["value"] > 2.0 * area["std"]  # type: ignore[operator]
    before, after = plates.evidence["holdout_error_before"], plates.evidence["holdout_error_after"]
    assert before is not None
    assert after is not None
    assert after < before / 4.0


def test_it_takes_no_longer_than_a_person_waits(cradle: Answered, other_way: Answered) -> None:
    assert max(cradle.seconds, other_way.seconds) <= LONGEST


def pendulum(length: float = 1.5, apart: float = 0.5) -> Rig:
    cables = tuple(
        Cable(f"cable_{i + 1}", np.array([x, 0.0, 0.0]), np.array([x, 0.0, 0.0]), length)
        for i, x in enumerate((-0.5 * apart, 0.5 * apart))
    )
    noise = {"mocap_position": 3e-4, "mocap_orientation": 1e-3}
    return Rig(9.80665, cables, 1.1, 0.002, noise=noise, tolerance=dict(DEFAULT_TOLERANCE))


ELEMENTS_OF_IT = np.array([1.1, 0.01, 0.0, -0.08, 0.05, 0.0, 0.0, 0.04, 0.0, 0.075])
#: A cradle of half a metre in the air, and how its turn softens: about what the real one shows.
SIDES, CUBE = 0.6, -0.17


def turned(y: float, yaw: float) -> Posed:
    return Posed(np.array([0.01, y, -1.49]), Rotation.from_rotvec([0.0, 0.0, yaw]).as_quat())


def watched(
    runs: tuple[RunSpec, ...], seed: int, effects: dict[str, tuple[float, ...]] | None = None
) -> Identification:
    """What is told of a simulated pendulum that motion capture alone watches."""
    rates = SampleRates(0.0, 0.0, 0.0, 0.0, 0.0, 100.0, 0.0)
    spec = SessionSpec("bifilar", pendulum(), ELEMENTS_OF_IT, runs, rates=rates, effects=effects or {})
    return identify(simulate_session(spec, np.random.default_rng(seed))[0])


@pytest.fixture(scope="module")
def in_the_air() -> Identification:
    """Air at its sides and a turn that softens, both concealed."""
    runs = (
        RunSpec("run_1", 30.0, turned(0.02, 0.3)),
        RunSpec("run_2", 20.0, turned(-0.01, 0.2), holdout=True),
    )
    effects = {"air_plates": (SIDES, 0.0), "air_plates.reach": (0.25,), "turning_cube": (CUBE,)}
    return watched(runs, 5, effects)


@pytest.mark.long
def test_air_and_a_softening_turn_are_told_apart_by_how_they_die(in_the_air: Identification) -> None:
    """To first order in the turn they look like other dampers, and another inertia."""
    sides = next(f for f in in_the_air.mismatch.findings if f.effect == "air_drag")
    area = sides.parameters["drag_area"]
    assert sides.where["axis"] == "x"
    assert abs(area["value"] - SIDES) < 3.0 * area["std"]  # type: ignore[operator]
    assert area["std"] < 0.1 * SIDES  # type: ignore[operator]
    value, std = cubic_moment(in_the_air)
    assert abs(value - CUBE) < 3.0 * std
    assert std < 0.1 * abs(CUBE)
    assert in_the_air.holdout_error == pytest.approx(1.0, abs=0.1)
    assert in_the_air.figures["ideal"].holdout_error > 3.0


@pytest.fixture(scope="module")
def simulated() -> tuple[Identification, np.ndarray]:
    """Turned by 0.3 rad and let go, nothing concealed."""
    start = turned(0.02, 0.3)
    runs = (RunSpec("run_1", 20.0, start), RunSpec("run_2", 12.0, start, holdout=True))
    return watched(runs, 3), ELEMENTS_OF_IT


def test_simulated_pendulum_gives_its_vertical_inertia(simulated: tuple[Identification, np.ndarray]) -> None:
    answer, truth = simulated
    zz = ELEMENTS.index("Jzz")
    std = float(np.sqrt(answer.total.covariance[zz, zz]))
    assert "Jzz" not in answer.total.unobservable
    assert abs(answer.total.values[zz] - truth[zz]) <= 3.0 * std
    assert element(answer, "Jzz") == pytest.approx(truth[zz], rel=0.03)


def test_simulated_pendulum_claims_no_more_than_it_tells(
    simulated: tuple[Identification, np.ndarray],
) -> None:
    """With white noise and nothing left out, second-order motion tells more: within the intervals stated."""
    answer, truth = simulated
    assert answer.mismatch.findings == ()
    assert answer.holdout_error == pytest.approx(1.0, abs=0.1)
    assert answer.mismatch.verdict == "none"
    std = np.sqrt(np.diag(answer.total.covariance))
    for name, error, s in zip(ELEMENTS, answer.total.values - truth, std, strict=True):
        assert name in answer.total.unobservable or abs(error) <= 3.5 * s, name


#: N m/rad with which the second cable's upper end holds it: a loop of a tenth of its length, askew.
END = (0.05, 0.2, 0.7)


@pytest.fixture(scope="module")
def held() -> tuple[Identification, np.ndarray]:
    """One cable ends in a loop, hinges damp at the ceiling alone, and the body is let go rolling."""

    def let_go(y: float, yaw: float, roll: float) -> Posed:
        turn = Rotation.from_euler("zx", [yaw, roll])
        return Posed(np.array([0.01, y, -1.49]), turn.as_quat())

    runs = (
        RunSpec("run_1", 30.0, let_go(0.02, 0.3, 0.06)),
        RunSpec("run_2", 20.0, let_go(-0.01, 0.2, -0.04), holdout=True),
    )
    effects = {"held_ends": (0.0, 0.0, 0.0, *END), "hinge_bending": (0.02, 0.0)}
    effects |= {"air_plates": (SIDES, 0.0), "air_plates.reach": (0.25,)}
    return watched(runs, 7, effects), ELEMENTS_OF_IT


@pytest.mark.long
def test_an_upper_end_that_holds_its_cable_is_found(held: tuple[Identification, np.ndarray]) -> None:
    answer, truth = held
    end = next(f for f in answer.mismatch.findings if f.where.get("law") == "held end")
    assert end.where["channel"] == "cable_2"
    principal = np.linalg.eigvalsh([[END[0], END[1]], [END[1], END[2]]])
    for name, value in zip(("stiffness", "stiffness_across"), principal[::-1], strict=True):
        told = end.parameters[name]
        assert abs(told["value"] - value) < 3.0 * told["std"], name  # type: ignore[operator]
    assert answer.holdout_error == pytest.approx(1.0, abs=0.1)
    zz = ELEMENTS.index("Jzz")
    assert abs(answer.total.values[zz] - truth[zz]) <= 3.0 * np.sqrt(answer.total.covariance[zz, zz])


@pytest.mark.long
def test_dry_hinges_that_stop_a_pendulum_are_found() -> None:
    """Beside a body fitted to roll at another frequency their moment was bent to next to nothing."""
    spec, truth = drawn("friction", 3, 2)
    answer = identify(simulate_session(spec, np.random.default_rng(3))[0])
    assert answer.mismatch.verdict == "explained"
    rubbing = next(f for f in answer.mismatch.findings if f.effect == "hinge_friction")
    told = rubbing.parameters["torque"]
    assert abs(told["value"] - spec.effects["hinge_friction"][0]) < 3.5 * told["std"]  # type: ignore[operator]
    assert not [f for f in answer.mismatch.findings if f.effect in ("hinge_damping", "air_drag")]
    assert answer.holdout_error == pytest.approx(1.0, abs=0.1)
    std = np.sqrt(np.diag(answer.total.covariance))
    for name, error, s in zip(ELEMENTS, answer.total.values - truth, std, strict=True):
        assert name in answer.total.unobservable or abs(error) <= 3.5 * s, name


def test_a_scan_over_depths_is_one_over_ways_of_rolling() -> None:
    """The rig's own modes, for a body of given gyration at the depth that a frequency asks for."""
    rig, gyration = pendulum(), 0.2
    for frequency in (0.55, 0.9, 1.4):
        depth = depth_of(frequency, 1.5, gyration, rig.gravity)
        elements = np.array([1.1, 0.0, 0.0, -depth, 1.1 * gyration**2, 0.0, 0.0, 0.06, 0.0, 0.075])
        model = rig_model(rig, elements)
        fastest = natural_modes(model, settle(model, design_pose(model)))[-1]
        assert "roll" in fastest.shape
        assert fastest.frequency == pytest.approx(frequency, rel=1e-4)
