"""Defects of recordings are found, counted and left out; what is sound stays, to the last bit."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from session_samples import edit_yaml, make_recording, make_rig, rewrite, shift_stamp, stamped, write_single

from rig_identification.cleaning.clipping import clipped_samples, limits
from rig_identification.cleaning.recording import clean
from rig_identification.cleaning.stamps import select_stamps
from rig_identification.errors import InputError
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.recording import ChannelQuality, Recording, Series
from rig_identification.session import read_session

IMU = "/rig/imu/data_raw"
CABLE = "/rig/cable_1/wrench"
SECOND = 1_000_000_000


def account(recording: Recording, topic: str = IMU) -> ChannelQuality:
    return next(item for item in recording.quality if item.topic == topic)


def read_edited(tmp_path: Path, edit: Callable[[str, int, Any], Any]) -> tuple[Recording, Recording]:
    """A sound recording, and what is read after every message went through ``edit``."""
    written = make_recording(seconds=3.0, seed=5, mocap=None, ground_truth=None, exciter_shaft=None)
    folder = write_single(written, tmp_path / "out")
    rewrite(folder / written.name, edit)
    return written, read_session(folder).recordings[0]


def assert_subset(read: Series | None, written: Series | None, left_out: set[int]) -> None:
    """``read`` is ``written`` without the samples ``left_out``."""
    assert read is not None
    assert written is not None
    kept = [i for i in range(len(written.time)) if i not in left_out]
    np.testing.assert_array_equal(read.time, written.time[kept])
    np.testing.assert_array_equal(read.values, written.values[kept])


def test_a_sound_recording_has_nothing_to_report(tmp_path: Path) -> None:
    recording = read_session(write_single(make_recording(), tmp_path / "out")).recordings[0]
    assert len(recording.quality) == 9
    for item in recording.quality:
        assert item.used == item.count > 0
        assert (item.gaps, item.missing, item.duplicated, item.backward) == (0, 0, 0, 0)
        assert (item.not_finite, item.clipped, item.notes) == (0, 0, ())
    assert account(recording).rate == pytest.approx(200.0)
    assert (account(recording).start, account(recording).end) == (0.0, 2.0)


def test_gaps(tmp_path: Path) -> None:
    lost = {100, *range(200, 210)}
    written, read = read_edited(tmp_path, lambda topic, i, m: None if topic == IMU and i in lost else m)
    assert_subset(read.imu, written.imu, lost)
    found = account(read)
    assert (found.gaps, found.missing, found.count) == (2, 11, 590)
    assert found.longest_gap == pytest.approx(11 / 200)


def test_duplicated_stamps(tmp_path: Path) -> None:
    def edit(topic: str, index: int, message: Any) -> Any:
        return shift_stamp(message, -SECOND // 200) if topic == IMU and index in wrong else message

    wrong = {50, 52, 300}
    written, read = read_edited(tmp_path, edit)
    assert_subset(read.imu, written.imu, wrong)
    assert (account(read).duplicated, account(read).backward, account(read).missing) == (3, 0, 3)


@pytest.mark.parametrize("back", [0.013, 0.3, 1.7])
def test_stamps_that_run_backwards(tmp_path: Path, back: float) -> None:
    wrong = {400, 450, 555}

    def edit(topic: str, index: int, message: Any) -> Any:
        return shift_stamp(message, -int(back * SECOND)) if topic == IMU and index in wrong else message

    written, read = read_edited(tmp_path, edit)
    assert_subset(read.imu, written.imu, wrong)
    assert account(read).backward == 3
    assert account(read).missing == 3


@pytest.mark.parametrize("ahead", [0.013, 0.3, 1.7, 30.0])
def test_single_stamps_ahead_do_not_cost_what_follows(tmp_path: Path, ahead: float) -> None:
    # A little ahead of the very last stamp is what overtaking looks like.
    wrong = {100, 450, 580 if ahead < 0.1 else 599}

    def edit(topic: str, index: int, message: Any) -> Any:
        return shift_stamp(message, int(ahead * SECOND)) if topic == IMU and index in wrong else message

    written, read = read_edited(tmp_path, edit)
    assert_subset(read.imu, written.imu, wrong)
    assert account(read).count - account(read).used == 3


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0, "3 stamps are zero"), (5, "3 stamps lie far"), (2_100_000_000, "3 stamps lie far")],
)
def test_stamps_that_were_never_set(tmp_path: Path, seconds: int, said: str) -> None:
    wrong = {0, 300, 600}

    def edit(topic: str, index: int, message: Any) -> Any:
        return stamped(message, seconds, 0) if topic == IMU and index in wrong else message

    written, read = read_edited(tmp_path, edit)
    assert_subset(read.imu, written.imu, wrong)
    assert read.start_ns == written.start_ns
    assert any(said in note for note in account(read).notes)


@pytest.mark.parametrize("count", [1, 40])
def test_a_gap_of_seconds_is_no_restart(tmp_path: Path, count: int) -> None:
    lost = set(range(count, 401))
    written, read = read_edited(tmp_path, lambda topic, i, m: None if topic == IMU and i in lost else m)
    assert_subset(read.imu, written.imu, lost)
    assert (account(read).gaps, account(read).missing, account(read).notes) == (1, len(lost), ())


@pytest.mark.parametrize("jump", [-1.2, -100.0, 40.0])
def test_a_device_that_restarts_keeps_its_longer_part(tmp_path: Path, jump: float) -> None:
    restarted = set(range(450, 601))

    def edit(topic: str, index: int, message: Any) -> Any:
        return shift_stamp(message, int(jump * SECOND)) if topic == IMU and index in restarted else message

    written, read = read_edited(tmp_path, edit)
    assert_subset(read.imu, written.imu, restarted)
    assert "151 messages on another clock" in " ".join(account(read).notes) or jump == -100.0
    assert read.duration == written.duration


def test_a_device_on_other_clock_is_left_aside(tmp_path: Path) -> None:
    def edit(topic: str, index: int, message: Any) -> Any:
        return shift_stamp(message, -1_700_000_000 * SECOND) if topic == IMU else message

    written, read = read_edited(tmp_path, edit)
    assert read.imu is None
    assert read.start_ns == written.start_ns
    assert "another clock" in account(read).notes[0]
    assert_subset(read.inclination, written.inclination, set())


def test_numbers_that_are_none(tmp_path: Path) -> None:
    """A number that cannot be damages its message; NaN says not measured, and leaves the rest."""
    wrong = {0: float("nan"), 77: float("inf"), 300: -float("inf"), 400: 1e300}

    def edit(topic: str, index: int, message: Any) -> Any:
        if topic != IMU or index not in wrong:
            return message
        rate = dataclasses.replace(message.angular_velocity, y=wrong[index])
        return dataclasses.replace(message, angular_velocity=rate)

    written, read = read_edited(tmp_path, edit)
    assert read.imu is not None
    assert written.imu is not None
    assert np.flatnonzero(np.isnan(read.imu.values)).tolist() == [1]
    told = np.where(np.isnan(read.imu.values), written.imu.values[: len(read.imu.time)], read.imu.values)
    assert_subset(Series(read.imu.time, told), written.imu, {77, 300, 400})
    assert (account(read).not_finite, account(read).gaps) == (3, 0)


def test_clipped_values(tmp_path: Path) -> None:
    limit = 4400.0
    written = make_recording(seconds=3.0, seed=5)
    sound = written.tension["cable_1"]
    clipped = set(np.flatnonzero(sound.values[:, 0] >= limit).tolist())
    cut = dataclasses.replace(sound, values=np.minimum(sound.values, limit))
    recording = dataclasses.replace(written, tension={**written.tension, "cable_1": cut})
    read = read_session(write_single(recording, tmp_path / "out")).recordings[0]
    assert len(clipped) > 100
    (end_at,) = limits(cut.values)
    assert_subset(read.tension["cable_1"], sound, set(np.flatnonzero(end_at.reached).tolist()))
    assert clipped == set(np.flatnonzero(end_at.stuck).tolist())
    assert not np.any(end_at.reached & (sound.values[:, 0] < limit - 50.0))
    assert account(read, CABLE).clipped == len(clipped)
    (end,) = account(read, CABLE).overranges
    assert (end.device, end.quantity, end.axis, end.unit) == ("cable_1", "tension", None, "N")
    assert (end.limit, end.samples) == (limit, len(clipped))
    assert account(read, "/rig/cable_2/wrench").clipped == 0


TIME = np.arange(5000) / 1000.0
SINE = np.sin(2.0 * np.pi * 0.8 * TIME)
NOISE = np.random.default_rng(0).normal(size=TIME.size)


@pytest.mark.parametrize(
    "values",
    [
        SINE,
        np.round(SINE * 50.0) / 50.0,
        np.round(NOISE * 3.0),
        np.maximum(3000.0 * SINE + NOISE, 0.0),
        np.where(TIME < 1.0, 0.0, SINE),
        np.where(TIME < 1.0, 0.0, 100.0),
        np.full(5000, 7.0),
        np.round(0.3 * NOISE + 10.0),
    ],
    ids=["sine", "coarse sine", "coarse noise", "slack cable", "late start", "step", "constant", "rest"],
)
def test_signals_that_are_not_clipped(values: np.ndarray) -> None:
    assert not clipped_samples(values[:, None]).any()


def test_both_ends_of_the_range_are_found() -> None:
    signal = SINE + 0.01 * NOISE
    clipped = clipped_samples(np.clip(signal, -0.8, 0.9)[:, None])
    np.testing.assert_array_equal(clipped, (signal <= -0.8) | (signal >= 0.9))


def test_the_crest_of_a_quick_swing_in_a_coarse_converter_is_no_limit() -> None:
    """Each step near the crest holds a sample or two: one that holds four by chance is no end of range."""
    time = np.arange(6000) / 500.0
    swing = 350.0 * np.sin(2.0 * np.pi * 3.0 * time) * np.exp(-time / 8.0)
    noisy = [swing + 0.3 * np.random.default_rng(seed).standard_normal(time.size) for seed in range(100)]
    assert sum(bool(limits(np.round(one)[:, None])) for one in noisy) <= 3
    assert all(limits(np.round(np.minimum(one, 300.0))[:, None]) for one in noisy[:20])


def test_what_is_left_of_a_clipped_signal_has_its_scale() -> None:
    """Of what lies near the limit noise decides what is stuck: the rest alone reads a scale too small."""
    signal, std = SINE, 0.15
    (lower, upper) = limits(np.clip(signal + std * NOISE, -0.8, 0.8)[:, None])
    reading = signal + std * NOISE

    def scale_error(kept: np.ndarray) -> float:
        """In its own std."""
        moved = signal[kept]
        return float(moved @ (reading[kept] - moved) / (std * np.sqrt(moved @ moved)))

    assert scale_error(~(lower.stuck | upper.stuck)) < -6.0
    kept = ~(lower.reached | upper.reached)
    assert np.count_nonzero(kept) > 1000
    assert abs(scale_error(kept)) < 3.0


def test_channels_that_measure_nothing(tmp_path: Path) -> None:
    nothing = float("nan")

    def edit(topic: str, index: int, message: Any) -> Any:
        if topic not in (CABLE, "/rig/exciter/wrench"):
            return message
        force = dataclasses.replace(message.wrench.force, x=nothing, y=nothing, z=nothing)
        return dataclasses.replace(message, wrench=dataclasses.replace(message.wrench, force=force))

    written, read = read_edited(tmp_path, edit)
    assert read.exciter_force is None
    assert read.exciter_unmeasured
    assert sorted(read.tension) == ["cable_2", "cable_3"]
    for topic in (CABLE, "/rig/exciter/wrench"):
        assert account(read, topic).used == 0
        assert "not measured" in account(read, topic).notes[0]
    assert_subset(read.imu, written.imu, set())


def test_an_exciter_without_a_cell_along_an_axis(tmp_path: Path) -> None:
    def edit(topic: str, index: int, message: Any) -> Any:
        if topic != "/rig/exciter/wrench":
            return message
        force = dataclasses.replace(message.wrench.force, z=float("nan"))
        return dataclasses.replace(message, wrench=dataclasses.replace(message.wrench, force=force))

    written, read = read_edited(tmp_path, edit)
    assert written.exciter_force is not None
    assert read.exciter_force is not None
    assert not read.exciter_unmeasured
    assert np.all(read.exciter_force.values[:, 2] == 0.0)
    assert np.array_equal(read.exciter_force.values[:, :2], written.exciter_force.values[:, :2])
    assert account(read, "/rig/exciter/wrench").notes == ("force z: not measured, taken as zero",)


def test_a_cable_that_the_description_does_not_know(tmp_path: Path) -> None:
    def forget(document: dict[str, Any]) -> None:
        parameters = document["/**"]["ros__parameters"]
        parameters["cables"].remove("cable_3")
        del parameters["cable_3"]

    folder = write_single(make_recording(), tmp_path / "out")
    edit_yaml(folder / "rig.yaml", forget)
    recording = read_session(folder).recordings[0]
    assert sorted(recording.tension) == ["cable_1", "cable_2"]
    assert "cable_3 is no cable" in account(recording, "/rig/cable_3/wrench").notes[0]


@pytest.mark.parametrize(("device", "channel"), [("imu", "imu"), ("inclinometer", "inclination")])
def test_a_device_that_the_description_does_not_know(tmp_path: Path, device: str, channel: str) -> None:
    folder = write_single(make_recording(), tmp_path / "out")
    edit_yaml(folder / "rig.yaml", lambda document: document["/**"]["ros__parameters"].pop(device))
    recording = read_session(folder).recordings[0]
    assert getattr(recording, channel) is None
    notes = [note for item in recording.quality for note in item.notes]
    assert notes == [f"the rig description has no {device}: left aside"]


def test_a_device_that_is_switched_off(tmp_path: Path) -> None:
    written = make_recording()
    off = Series(written.tension["cable_1"].time, np.zeros_like(written.tension["cable_1"].values))
    recording = dataclasses.replace(written, tension={**written.tension, "cable_1": off})
    read = read_session(write_single(recording, tmp_path / "out")).recordings[0]
    assert_subset(read.tension["cable_1"], off, set())
    assert "never change" in account(read, CABLE).notes[0]


def test_mocap_without_orientation(tmp_path: Path) -> None:
    written = make_recording()
    assert written.mocap is not None
    values = np.array(written.mocap.values)
    values[10, 3:] = 0.0
    recording = dataclasses.replace(written, mocap=Series(written.mocap.time, values))
    read = read_session(write_single(recording, tmp_path / "out")).recordings[0]
    assert_subset(read.mocap, written.mocap, {10})
    assert account(read, "/rig/mocap/pose").not_finite == 1


STAMPS = st.integers(0, 60).flatmap(
    lambda size: st.tuples(
        arrays(np.int64, size, elements=st.integers(-9, 2**31) | st.integers(0, 50)),
        arrays(np.int64, size, elements=st.integers(0, 2**33)),
    )
)


@settings(max_examples=300, deadline=None)
@given(STAMPS, st.sampled_from([1, 1_000_000, SECOND]))
def test_any_stamps_give_a_clock_that_runs_forwards(pair: tuple[np.ndarray, np.ndarray], unit: int) -> None:
    stamps, received = pair[0] * unit, pair[1]
    selection = select_stamps(stamps, received)
    assert np.all(np.diff(stamps[selection.kept]) > 0)
    assert np.all(stamps[selection.kept] > 0)
    assert (len(selection.kept) > 0) == bool(np.any(stamps > 0))
    assert min(selection.duplicated, selection.backward) >= 0


@pytest.mark.parametrize(("pause", "kept"), [(600.0, 300), (1e9, 200)])
def test_both_clocks_that_jump_for_years_are_no_pause(pause: float, kept: int) -> None:
    """A machine without a battery finds its network: stamps and receive times jump together."""
    stamps = (1 + np.arange(300)) * 20_000_000 + 1_793_243_600_000_000_000
    stamps[200:] += round(pause * 1e9)
    selection = select_stamps(stamps, stamps + 2_000_000)
    assert selection.kept.tolist() == list(range(kept))
    assert bool(selection.notes) == (kept < 300)


@pytest.mark.parametrize(
    ("kind", "hours", "refused"),
    [("dynamic", 2.0, ""), ("dynamic", 4.0, "10800 s"), ("static", 4.0, ""), ("static", 30.0, "86400 s")],
)
def test_a_recording_of_days_is_refused(kind: str, hours: float, refused: str) -> None:
    """Few samples whose stamps lie far apart: a model of every second between takes gigabytes."""
    count = 40
    stamps = 1_793_243_600_000_000_000 + (np.arange(count) * hours * 3.6e12 / (count - 1)).astype(np.int64)
    values = 4000.0 + np.random.default_rng(0).standard_normal((count, 1))
    cell = RawChannel("/rig/cable_1/wrench", "tension", "", stamps, stamps, values, "cable_1")
    raw = RawSession("s", make_rig(), (RawRecording("run_1", kind, False, "run_1", (cell,)),))
    if refused:
        with pytest.raises(InputError, match=refused):
            clean(raw)
    else:
        assert clean(raw).recordings[0].duration == pytest.approx(hours * 3600.0)
