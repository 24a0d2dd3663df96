"""Channels against each other: the models behind the evidence, and what it tells of wrong set-ups."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.check.consistency import identical, judge
from rig_identification.check.consistency.evidence import Evidence
from rig_identification.check.consistency.faults import turned as imu_turned
from rig_identification.check.consistency.faults.axes import signed_permutations
from rig_identification.check.consistency.forces import ForceModel
from rig_identification.check.consistency.motion import MotionModel, nats
from rig_identification.check.consistency.reduced import PER_SPAN, ReducedSession, reduced
from rig_identification.check.consistency.rest import _moved, fit_rest, joined
from rig_identification.check.consistency.rest_model import Loosened, RestModel
from rig_identification.check.consistency.tracker import TrackerModel
from rig_identification.check.consistency.trajectory import Trajectory
from rig_identification.cli.commands.demo import demo_spec
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.rig import Mount, Rig
from rig_identification.session import read_raw, read_rig, write_session
from rig_identification.simulate import Pulled, RunSpec, SampleRates, SessionSpec, simulate_session

Array = NDArray[np.float64]
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
pytestmark = pytest.mark.xdist_group("check_consistency")


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> RawSession:
    """The car of case 14 with a tracker, as recorded and with nothing wrong."""
    spec = demo_spec(8.0)
    spec = replace(spec, rates=replace(SampleRates(), mocap=100.0, tension=250.0, exciter=250.0))
    session, _ = simulate_session(spec, np.random.default_rng(5))
    return read_raw(write_session(session, tmp_path_factory.mktemp("clean") / "session"))


@pytest.fixture(scope="module")
def small(clean: RawSession) -> ReducedSession:
    return reduced(clean)


def changed(raw: RawSession, device: str, change: Callable[[Array], Array], kind: str = "") -> RawSession:
    """The session with one device's readings changed in every recording of a kind."""

    def one(channel: RawChannel) -> RawChannel:
        if channel.device != device or channel.channel == "exciter_shaft":
            return channel
        return replace(channel, values=change(np.array(channel.values)))

    recordings = tuple(
        replace(r, channels=tuple(one(c) for c in r.channels)) if kind in ("", r.kind) else r
        for r in raw.recordings
    )
    return replace(raw, recordings=recordings)


def told(raw: RawSession) -> list[SetupFault]:
    return [found.fault for found in judge.judged(raw).found]


def columns(factor: float, part: slice) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values[:, part] *= factor
        return values

    return change


def turned(part: slice, turn: Array) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values[:, part] = values[:, part] @ turn
        return values

    return change


def described(rig: Rig) -> Rig:
    """The rig with its marker described: at the body's datum, along its axes."""
    return replace(rig, mocap=Mount(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])))


def test_nothing_is_told_of_a_sound_session(clean: RawSession) -> None:
    assert told(clean) == []
    assert told(replace(clean, rig=described(clean.rig))) == []
    assert identical.find(clean) == ()


def test_rest_finds_the_body_and_slopes_are_the_derivatives(small: ReducedSession) -> None:
    fit = fit_rest(small.rig, small.at_rest)
    assert fit is not None
    assert fit.square < fit.readings
    assert fit.mass == pytest.approx(small.rig.mass, rel=0.01)
    model = RestModel(small.rig, small.at_rest)
    rng = np.random.default_rng(1)
    step = 1e-6 * rng.standard_normal(model.size)
    slope = model.rows(fit.unknown, fit.poses, 1e-3)[1]
    after, _ = model.rows(*_moved(model, fit.unknown, fit.poses, step), 1e-3)
    back, _ = model.rows(*_moved(model, fit.unknown, fit.poses, -step), 1e-3)
    wanted = slope @ step
    np.testing.assert_allclose(0.5 * (after - back), wanted, rtol=1e-4, atol=1e-5 * np.abs(wanted).max())


def test_readings_that_join_a_fit_cost_what_the_whole_fit_says(small: ReducedSession) -> None:
    """To first order about a fit without the cells, with a cell 4 % high and its belief given up or not."""
    cells = frozenset(c.name for c in small.rig.cables)
    name = small.rig.cables[0].name
    high = tuple(r.with_values({name: 1.04 * r.values[name]}) for r in small.at_rest)
    lacking = [replace(r, values={d: v for d, v in r.values.items() if d not in cells}) for r in high]
    without = fit_rest(small.rig, lacking)
    assert without is not None
    for loosened in (Loosened(), Loosened(gains=(name,))):
        whole = fit_rest(small.rig, high, loosened)
        assert whole is not None
        first_order = joined(without, small.rig, high, cells, loosened)
        assert first_order.square == pytest.approx(whole.square, rel=0.2, abs=0.5)
        np.testing.assert_allclose(first_order.value("gain")[0], whole.value("gain")[0], atol=0.01)


def test_motion_slopes_are_the_derivatives(small: ReducedSession) -> None:
    run = small.runs[0]
    fit = fit_rest(small.rig, small.at_rest)
    assert fit is not None
    model = MotionModel(described(small.rig), run, *fit.poses[0])
    about = model.settled(run.values).trajectory
    rng = np.random.default_rng(2)
    step = 1e-5 * rng.standard_normal((3, run.time.size, 6))

    def moved(sign: float) -> Trajectory:
        return model._moved(about, (sign * step[0], sign * step[1], sign * step[2]))

    for at, up, down in zip(
        model._blocks(about, run.values),
        model._blocks(moved(1.0), run.values),
        model._blocks(moved(-1.0), run.values),
        strict=True,
    ):
        wanted = sum(
            np.einsum("nwd,nd->nw", slope, part)
            for slope, part in zip(at.slopes, step, strict=True)
            if slope is not None
        )
        found = 0.5 * (down.miss - up.miss)  # what is missed falls as the prediction rises
        # Terms of second order in the turn are left out: a step needs no more
        assert np.nanmax(np.abs(found - wanted)) < 0.1 * np.nanmax(np.abs(wanted)), at.name


def test_a_motion_is_found_and_its_forces_agree(small: ReducedSession) -> None:
    run = small.runs[0]
    fit = fit_rest(small.rig, small.at_rest)
    assert fit is not None
    motion = MotionModel(small.rig, run, *fit.poses[0]).settled(run.values)
    assert all(np.all(left < 0.5) for left in motion.left.values())
    forces = ForceModel(small.rig, motion.trajectory, fit)
    cost, left = forces.cost(run.values)
    assert np.all(left < 1.0)
    names = [c.name for c in small.rig.cables]
    swapped = {**run.values, names[0]: run.values[names[1]], names[1]: run.values[names[0]]}
    assert forces.cost(swapped)[0] > cost + 20.0
    tracker = TrackerModel(small.rig, *fit.poses[0], motion.trajectory)
    mirrored = run.values["mocap"] * [-1.0, 1.0, 1.0, 1.0, -1.0, -1.0, 1.0]
    assert tracker.cost(mirrored) > tracker.cost(run.values["mocap"]) + 20.0


def test_a_tracker_alone_is_held_against_the_cables_in_any_room(small: ReducedSession) -> None:
    """Its room may be turned by any heading that is tried; mirrored poses stretch the cables."""
    fit = fit_rest(small.rig, small.at_rest)
    assert fit is not None
    tracker, poses = TrackerModel(small.rig, *fit.poses[0], None), small.runs[0].values["mocap"]
    room = Rotation.from_rotvec([0.0, 0.0, np.pi / 6.0])
    there = np.concatenate(
        [room.apply(poses[:, :3]), (room * Rotation.from_quat(poses[:, 3:])).as_quat()], axis=1
    )
    assert tracker.cost(there) == pytest.approx(tracker.cost(poses), abs=1e-6)
    assert tracker.cost(poses * [1.0, 1.0, -1.0, -1.0, -1.0, 1.0, 1.0]) > tracker.cost(poses) + 5.0


def test_a_tracker_whose_marker_is_described_takes_part_in_the_motion(small: ReducedSession) -> None:
    """Without the IMU it tells the motion; in a room of another heading it tells the same."""
    run = small.runs[0]
    fit = fit_rest(small.rig, small.at_rest)
    assert fit is not None
    model = MotionModel(described(small.rig), run, *fit.poses[0])
    wanted = model.settled(run.values).trajectory
    alone = {"mocap": run.values["mocap"]}
    turn = Rotation.from_rotvec([0.0, 0.0, 1.0])
    known = run.values["mocap"]
    turned = np.concatenate(
        [turn.apply(known[:, :3]), (turn * Rotation.from_quat(known[:, 3:])).as_quat()], 1
    )
    for values in (alone, {"mocap": turned}):
        found = model.settled(values)
        assert {"mocap_place", "mocap_turn"} <= found.cost.keys()
        miss = found.trajectory.turn - wanted.turn
        assert np.std(miss - miss.mean(axis=0)) < 0.1 * np.std(wanted.turn)


def test_forces_take_cells_by_the_gains_that_rest_tells(small: ReducedSession) -> None:
    """A cell 30 % high disagrees where its gain is believed, and agrees where rest has found it."""
    run, name = small.runs[0], small.rig.cables[0].name
    high = {name: 1.3 * run.values[name]}
    at_rest = tuple(r.with_values({name: 1.3 * r.values[name]}) for r in small.at_rest)
    sound = fit_rest(small.rig, small.at_rest)
    found = fit_rest(small.rig, at_rest, Loosened(gains=(name,)))
    assert sound is not None
    assert found is not None
    motion = MotionModel(small.rig, run, *sound.poses[0]).settled(run.values).trajectory
    as_it_was = ForceModel(small.rig, motion, sound).cost(run.values)[0]
    believed = ForceModel(small.rig, motion, sound).cost({**run.values, **high})[0]
    told = ForceModel(small.rig, motion, sound, found).cost({**run.values, **high})[0]
    assert told == pytest.approx(as_it_was, abs=3.0)
    assert believed > told + 3.0


def test_the_likelihood_is_that_of_what_was_recorded() -> None:
    """A hypothesis gains nothing by scaling a reading down until its floor covers it."""
    spread, floor, share = 1.0, 0.01, 0.15

    def cost(factor: float, left: float) -> float:
        std = np.hypot(floor, share * factor * spread)
        return float(nats(np.array([left**2 / std**2]), np.array([std / (factor * spread)]))[0])

    assert cost(1e-3, 1e-3) > cost(1.0, 0.05)
    assert cost(1.0, 0.5) > cost(1.0, 0.05) > cost(1.0, 0.005)


def test_signed_permutations_are_all_and_each_once() -> None:
    found = {tuple(map(tuple, turn)) for turn in signed_permutations(3)}
    assert len(found) == 47
    assert all(abs(np.linalg.det(np.array(turn))) == 1.0 for turn in found)
    assert len(signed_permutations(2)) == 7


def test_runs_come_in_whole_spans_of_the_spline(small: ReducedSession) -> None:
    assert all(run.time.size % PER_SPAN == 0 for run in small.runs)


def exciter_swapped(raw: RawSession) -> RawSession:
    names = [c.name for c in raw.rig.cables[:2]]

    def one(channel: RawChannel, others: dict[str | None, RawChannel]) -> RawChannel:
        if channel.cable not in names:
            return channel
        source = others[names[1 - names.index(channel.cable)]]
        return replace(source, topic=channel.topic, cable=channel.cable)

    def swapped(recording: RawRecording) -> RawRecording:
        by_cable = {c.cable: c for c in recording.channels}
        return replace(recording, channels=tuple(one(c, by_cable) for c in recording.channels))

    return replace(raw, recordings=tuple(swapped(r) for r in raw.recordings))


def bare_and_dummy(raw: RawSession) -> RawSession:
    dummies = [r.dummy for r in raw.recordings]
    dummies[0], dummies[1] = dummies[1], dummies[0]
    recordings = tuple(replace(r, dummy=d) for r, d in zip(raw.recordings, dummies, strict=True))
    return replace(raw, recordings=recordings)


def gravity_gone(raw: RawSession) -> RawSession:
    """Specific force less what the IMU reads at rest, as a driver does that levels once."""
    rest = raw.recordings[0].channel("imu")
    assert rest is not None
    mean = rest.values[:, 3:].mean(axis=0)

    def change(values: Array) -> Array:
        values[:, 3:] -= mean
        return values

    return changed(raw, "imu", change)


def counted(raw: RawSession) -> RawSession:
    """Counts that chance to lie near newtons, each cell with a scale and a zero of its own."""
    weight = 9.81 * (raw.rig.mass or 0.0)
    for k, cable in enumerate(raw.rig.cables):
        scale, zero = 0.8 + 0.15 * k, 0.1 * weight * (-1.0) ** k
        raw = changed(raw, cable.name, lambda v, scale=scale, zero=zero: np.round(scale * v + zero))  # type: ignore[misc]
    return raw


FAULTS: dict[str, tuple[Callable[[RawSession], RawSession], str, object]] = {
    "cell in lbf": (lambda raw: changed(raw, "cable_2", lambda v: v / 4.4482216), "unit", "cable_2"),
    "gyroscope in degrees": (
        lambda raw: changed(raw, "imu", columns(180.0 / np.pi, slice(0, 3))),
        "unit",
        "imu",
    ),
    "gyroscope y reversed": (lambda raw: changed(raw, "imu", columns(-1.0, slice(1, 2))), "axes", "imu"),
    "accelerometer turned": (lambda raw: changed(raw, "imu", turned(slice(3, 6), TURN)), "axes", "imu"),
    "gravity reversed": (lambda raw: changed(raw, "imu", columns(-1.0, slice(3, 6))), "axes", "imu"),
    "gravity taken out": (gravity_gone, "axes", "imu"),
    "inclinometer exchanged": (
        lambda raw: changed(raw, "inclinometer", lambda v: v[:, ::-1]),
        "axes",
        "inclinometer",
    ),
    "quaternion w first": (
        lambda raw: changed(raw, "mocap", lambda v: v[:, [0, 1, 2, 6, 3, 4, 5]]),
        "axes",
        "mocap",
    ),
    "IMU in g and degrees": (
        lambda raw: changed(
            changed(raw, "imu", columns(180.0 / np.pi, slice(0, 3))),
            "imu",
            columns(1.0 / 9.80665, slice(3, 6)),
        ),
        "unit",
        "imu",
    ),
    "tracker's positions mirrored": (
        lambda raw: changed(replace(raw, rig=described(raw.rig)), "mocap", columns(-1.0, slice(1, 2))),
        "axes",
        "mocap",
    ),
    "cells in counts": (
        lambda raw: counted(raw),
        "unit",
        ["cable_1", "cable_2", "cable_3", "cable_4"],
    ),
    "tracker in mm": (lambda raw: changed(raw, "mocap", columns(1000.0, slice(0, 3))), "unit", "mocap"),
    "cells swapped": (exciter_swapped, "wiring", ["cable_1", "cable_2"]),
    "cell negative": (lambda raw: changed(raw, "cable_3", lambda v: -v), "wiring", "cable_3"),
    "bare and dummy swapped": (bare_and_dummy, "wiring", "session"),
    "mass in pounds": (
        lambda raw: replace(raw, rig=replace(raw.rig, mass=(raw.rig.mass or 0.0) / 0.45359237)),
        "mass_error",
        "description",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_named_alone(clean: RawSession, name: str) -> None:
    put, effect, channel = FAULTS[name]
    faults = told(put(clean))
    assert [fault.effect for fault in faults] == [effect]
    assert faults[0].where["channel"] == channel
    assert faults[0].gain > 15.0


def test_what_is_corrected_is_what_was_recorded_before(clean: RawSession) -> None:
    """An IMU whose axes are exchanged comes back as it was, to the last bit."""
    broken = changed(changed(clean, "imu", turned(slice(0, 3), TURN)), "imu", turned(slice(3, 6), TURN))
    verdict = judge.judged(broken)
    assert [found.fault.effect for found in verdict.found] == ["axes"]
    for recording, before in zip(verdict.found[-1].session.recordings, clean.recordings, strict=True):
        one, other = recording.channel("imu"), before.channel("imu")
        assert one is not None
        assert other is not None
        np.testing.assert_array_equal(one.values, other.values)
    assert "orientation" in verdict.found[0].fault.correction


def test_a_zeroed_cell_is_found_and_its_zero_estimated(clean: RawSession) -> None:
    at_rest = clean.recordings[0].channel("cable_1")
    assert at_rest is not None
    load = float(at_rest.values.mean())
    verdict = judge.judged(changed(clean, "cable_1", lambda v: v - load))
    (fault,) = [found.fault for found in verdict.found]
    assert fault.effect == "zeroed_cell"
    offset = fault.parameters["offset"]
    assert abs(float(str(offset["value"])) + load) < 3.0 * float(str(offset["std"]))


def test_two_cables_on_one_channel(clean: RawSession) -> None:
    def copied(recording: RawRecording) -> RawRecording:
        source = recording.channel("cable_1")
        assert source is not None
        target = recording.channel("cable_4")
        assert target is not None
        copy = replace(source, topic=target.topic, cable="cable_4")
        return recording.with_channels(copy)

    (found,) = identical.find(replace(clean, recordings=tuple(copied(r) for r in clean.recordings)))
    assert found.fault.where["kind"] == "one_channel"
    assert all(r.channel("cable_4") is None for r in found.session.recordings)
    assert np.isfinite(found.fault.gain)


def test_one_run_under_two_names(clean: RawSession) -> None:
    run = clean.recordings[2]
    again = replace(clean.recordings[3], channels=run.channels)
    (found,) = identical.find(replace(clean, recordings=(*clean.recordings[:3], again)))
    assert found.fault.where["kind"] == "same_recording"
    assert [r.name for r in found.session.recordings] == [r.name for r in clean.recordings[:3]]


def test_leaving_a_device_out_bounds_what_its_faults_can_gain(clean: RawSession) -> None:
    evidence = Evidence(reduced(changed(clean, "imu", columns(-1.0, slice(1, 2)))))
    gained = max(w.gain for w in judge._weighed(evidence))
    assert gained <= evidence.bound(frozenset(["imu"])) + 30.0


def test_a_session_without_rest_or_devices_is_no_fault(clean: RawSession, tmp_path: Path) -> None:
    runs = tuple(r for r in clean.recordings if r.kind == "dynamic")
    assert told(replace(clean, recordings=runs)) == []
    bare = tuple(replace(r, channels=()) for r in clean.recordings)
    assert told(replace(clean, recordings=bare)) == []
    only = tuple(
        replace(r, channels=tuple(c for c in r.channels if c.device == "mocap")) for r in clean.recordings
    )
    assert told(replace(clean, recordings=only)) == []


def test_rotations_of_the_trajectory_are_consistent() -> None:
    """The rate that a rotation vector implies is that of the rotation itself, by differences."""
    time = np.linspace(0.0, 1.0, 2001)
    q = np.stack([0.3 * np.sin(3.0 * time), 0.2 * np.cos(2.0 * time), 0.25 * np.sin(time + 1.0)], axis=1)
    first, second = (np.gradient(q, time, axis=0), np.gradient(np.gradient(q, time, axis=0), time, axis=0))
    zero = np.zeros_like(q)
    at = Trajectory(zero, zero, zero, q, first, second, np.eye(3))
    turns = Rotation.from_rotvec(q)
    rate = (turns[:-2].inv() * turns[2:]).as_rotvec() / (2.0 * (time[1] - time[0]))
    np.testing.assert_allclose(at.rate[1:-1], rate, atol=0.01)
    np.testing.assert_allclose(at.rate_change[50:-50], np.gradient(at.rate, time, axis=0)[50:-50], atol=0.05)


@pytest.mark.parametrize("seed", [1, 3])
def test_two_parallel_cables_tell_nothing_of_a_trackers_sense(seed: int, tmp_path: Path) -> None:
    """A body on them moves without stretching them in the first order; what is left is the second order."""
    rig = read_rig(Path(__file__).parents[1] / "config" / "bifilar.yaml")
    body = np.array([12.0, 0.4, 0.0, -0.05, 0.09, 0.0, 0.0, 1.1, 0.0, 1.15])
    run = RunSpec("run_1", 8.0, Pulled(np.array([4.4, 5.5, 0.0]), body[1:4] + np.array([0.12, 0.0, 0.0])))
    rates = SampleRates(tension=0.0, mocap=60.0)
    spec = SessionSpec("bar", rig, body, (run,), rates=rates)
    session, _ = simulate_session(spec, np.random.default_rng(seed))
    assert told(read_raw(write_session(session, tmp_path / "bar"))) == []


def test_an_imu_at_a_mount_that_no_line_gives_is_found_by_the_motion(clean: RawSession) -> None:
    """With a tracker the motion is known without it: its turn and place are told, and corrected."""
    turn = Rotation.from_rotvec([0.3, -0.2, 0.5])
    raw = clean
    for part in (slice(0, 3), slice(3, 6)):
        raw = changed(raw, "imu", turned(part, turn.as_matrix()))
    rig = described(clean.rig)
    assert rig.imu is not None
    aside = replace(rig.imu, position=rig.imu.position + np.array([1.4, -1.3, 0.1]))
    (found,) = judge.judged(replace(raw, rig=replace(rig, imu=aside))).found
    fault, mended = found.fault, found.session.rig
    assert (fault.effect, fault.where["channel"]) == ("imu_misalignment", "imu")
    assert fault.corrected
    assert "orientation:" in fault.correction
    value, std = (float(str(fault.parameters["angle"][k])) for k in ("value", "std"))
    assert abs(value - turn.magnitude()) < 3.0 * std < 0.3
    assert mended.imu is not None
    true = Rotation.from_quat(rig.imu.orientation) * turn
    off = true.inv() * Rotation.from_quat(mended.imu.orientation)
    assert off.magnitude() < 3.0 * mended.tolerance["imu_orientation"]
    away = np.linalg.norm(mended.imu.position - rig.imu.position)
    assert away < max(3.0 * mended.tolerance["imu_position"], 0.2)


def test_an_imu_that_only_the_second_run_heard_is_held_against_no_other_motion(small: ReducedSession) -> None:
    """Of runs that differ in length the first one's motion is no measure of the second one's IMU."""
    first = small.runs[0]
    longer = {d: np.concatenate([v, v[:PER_SPAN]]) for d, v in first.values.items()}
    second = replace(
        first, name="second", values=longer, time=first.kernel * np.arange(float(len(longer["imu"])))
    )
    deaf = replace(first, values={d: v for d, v in first.values.items() if d != "imu"})
    evidence = Evidence(ReducedSession(small.rig, (*small.at_rest, deaf, second)))
    assert all(h.change is not None for h in judge.proposals(evidence))


def test_no_mount_is_sought_where_nothing_moves(clean: RawSession) -> None:
    """Rest alone tells no heading of an IMU that hangs upside down."""
    upside_down = changed(clean, "imu", columns(-1.0, slice(3, 6)))
    resting = tuple(r for r in upside_down.recordings if r.kind == "static")
    evidence = Evidence(reduced(replace(upside_down, recordings=resting)))
    assert evidence.bound(frozenset(["imu"])) > 10.0
    assert list(imu_turned.hypotheses(evidence)) == []


def test_a_mount_that_the_motion_does_not_tell_is_not_guessed(small: ReducedSession) -> None:
    """It is said that the IMU lies otherwise, whose mount it was given, and it is left out."""
    lies = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_quat()
    rig, given = small.rig, Mount(np.ones(3), lies)
    assert rig.exciter is not None
    copied = replace(rig, imu=given, exciter=replace(rig.exciter, orientation=lies))
    vague = imu_turned.Found(Mount(np.ones(3), np.array([0.0, 0.0, 0.0, 1.0])), 0.3, 0.1)
    hypothesis = imu_turned.of_mount(copied, given, vague, moved=True)
    fault = hypothesis.describe(None)
    assert (fault.effect, fault.where["mount"]) == ("wiring", "exciter")
    assert not fault.corrected
    assert not fault.parameters
    rest = fit_rest(rig, small.at_rest)
    assert rest is not None
    assert hypothesis.fitted is not None
    assert hypothesis.fitted(rest).left_out == ("imu",)
    sure = imu_turned.of_mount(copied, given, replace(vague, turn_std=0.02), moved=True)
    assert sure.fitted is not None
    right = sure.fitted(rest).rig
    assert right is not None
    assert right(copied).tolerance["imu_orientation"] == pytest.approx(0.02)
