"""What the bags hold, what is missing and what goes unused: nothing of it without a word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from session_samples import CABLES, START_NS, make_rig

from rig_identification.check.examine import examine
from rig_identification.check.inventory import inventory, offsets, span_of
from rig_identification.check.left_aside import left_aside
from rig_identification.check.order import out_of_order
from rig_identification.examination import TopicAccount
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.rig import Rig

WRENCH, IMU = "geometry_msgs/msg/WrenchStamped", "sensor_msgs/msg/Imu"
#: Topic below the namespace -> channel, message type, width, Hz.
SENT = {
    **{f"{cable}/wrench": ("tension", WRENCH, 1, 100.0) for cable in CABLES},
    "exciter/wrench": ("exciter_force", WRENCH, 3, 100.0),
    "imu/data_raw": ("imu", IMU, 6, 200.0),
    "inclinometer/angles": ("inclination", "geometry_msgs/msg/Vector3Stamped", 2, 20.0),
    "mocap/pose": ("mocap", "geometry_msgs/msg/PoseStamped", 7, 50.0),
}
LATENCY = 2_000_000  # ns
DEVICES = tuple(topic.partition("/")[0] for topic in SENT)


def channel(name: str, seconds: float = 10.0, late: float = 0.0) -> RawChannel:
    """One topic; its device's clock is ``late`` seconds ahead of the recorder's."""
    kind, message_type, width, rate = SENT[name]
    times = np.round(np.arange(seconds * rate) / rate * 1e9).astype(np.int64)
    received = START_NS + times + LATENCY
    stamps = START_NS + times + round(late * 1e9)
    values = np.random.default_rng(len(name)).normal(size=(len(times), width))
    cable = name.partition("/")[0] if kind == "tension" else None
    return RawChannel(f"/rig/{name}", kind, message_type, stamps, received, values, cable)


def recording(name: str, kind: str = "dynamic", without: tuple[str, ...] = (), **late: float) -> RawRecording:
    """Every device, but ``without`` the topics named; ``imu=37.0`` sets the IMU's clock ahead."""
    names = [topic for topic in SENT if topic not in without]
    channels = tuple(channel(topic, late=late.get(topic.partition("/")[0], 0.0)) for topic in names)
    return RawRecording(
        name, kind, False, f"/bags/{name}", channels,
        {c.topic: c.message_type for c in channels}, {c.topic: len(c.stamp_ns) for c in channels},
    )  # fmt: skip


def beside(one: RawRecording, topic: str, message_type: str, count: int = 7) -> RawRecording:
    """The recording with a topic that no channel is read from."""
    return replace(one, listed={**one.listed, topic: message_type}, counts={**one.counts, topic: count})


def told(*recordings: RawRecording, rig: Rig | None = None, namespace: str = "/rig") -> tuple[str, ...]:
    """Warnings of a session in which no fault was found."""
    raw = RawSession("van", rig or make_rig(), recordings, namespace)
    return left_aside(raw, raw, inventory(raw, raw)).warnings


def accounts(*recordings: RawRecording, used: RawSession | None = None) -> dict[str, TopicAccount]:
    raw = RawSession("van", make_rig(), recordings)
    return {account.topic: account for account in inventory(raw, used or raw)}


def test_a_complete_session_has_no_warning() -> None:
    static = recording("bare", "static", without=("exciter/wrench",))
    raw = RawSession("van", make_rig(), (static, recording("run_1"), recording("run_2")))
    found = left_aside(raw, raw, inventory(raw, raw))
    assert found.warnings == ()
    assert found.notes == ()


def test_an_account_says_rate_span_gaps_and_clock() -> None:
    whole = channel("imu/data_raw", late=-3.0)
    keep = np.r_[:500, 700:2000]  # a second is missing
    holed = replace(
        whole, stamp_ns=whole.stamp_ns[keep], received_ns=whole.received_ns[keep], values=whole.values[keep]
    )
    found = accounts(recording("run_1").with_channels(holed))
    imu = found["/rig/imu/data_raw"]
    assert (imu.device, imu.used, imu.count, imu.note) == ("imu", True, 1800, "")
    assert imu.rate == pytest.approx(200.0)
    assert (imu.gaps, imu.longest_gap) == (1, pytest.approx(1.005))
    assert imu.clock == pytest.approx(3.002)
    assert (imu.start, imu.end) == (0.0, pytest.approx(9.995))  # its clock is the first to begin
    assert found["/rig/cable_1/wrench"].start == pytest.approx(3.0)


def test_receive_times_that_tell_nothing_make_no_clock() -> None:
    imu = channel("imu/data_raw")
    copied = replace(imu, received_ns=imu.stamp_ns)
    at_once = replace(imu, received_ns=np.full_like(imu.received_ns, START_NS))
    for one in (copied, at_once):
        assert accounts(recording("run_1").with_channels(one))["/rig/imu/data_raw"].clock is None


def test_a_stray_stamp_moves_no_device() -> None:
    stamps = channel("imu/data_raw").stamp_ns.copy()
    clean = span_of(stamps)
    stamps[3] = 1  # a stamp that was never set
    stray = span_of(stamps)
    assert clean is not None
    assert stray is not None
    assert abs(stray.first - clean.first) < 0.2e9
    assert span_of(np.zeros(4, np.int64)) is None


@given(st.sampled_from([-3e7, -3600.0, -37.0, 37.0, 100.0, 1e6]), st.sampled_from(sorted(SENT)))
def test_a_device_on_other_clock_is_told_with_its_amount(late: float, topic: str) -> None:
    one = recording("run_1", **{topic.partition("/")[0]: late})
    sentences = told(one)
    apart = offsets(one)
    assert all(amount == pytest.approx(late, abs=0.1) for amount in apart.values())
    assert f"/rig/{topic}" in apart
    assert any(topic in s and "share no time" in s for s in sentences)
    assert not inventory(RawSession("v", make_rig(), (one,)), RawSession("v", make_rig(), (one,)))[
        list(SENT).index(topic)
    ].used


def test_a_late_but_overlapping_device_is_used() -> None:
    found = accounts(recording("run_1", imu=4.0))
    assert found["/rig/imu/data_raw"].used
    assert told(recording("run_1", imu=4.0)) == ()


@pytest.mark.parametrize("topic", sorted(SENT))
def test_what_is_mounted_and_nowhere_recorded_is_told(topic: str) -> None:
    device = topic.partition("/")[0]
    (sentence,) = told(recording("run_1", without=(topic,)), recording("run_2", without=(topic,)))
    assert sentence.startswith(f"{device}: ")
    assert f"no bag holds a message of /rig/{topic}" in sentence


def test_what_only_some_bags_hold_is_told_with_the_bags() -> None:
    (sentence,) = told(
        recording("bare", "static", without=("imu/data_raw",)),
        recording("run_1", without=("imu/data_raw",)),
        recording("run_2"),
    )
    assert "/rig/imu/data_raw is missing in bare and run_1" in sentence


def test_an_imu_of_another_name_is_proposed() -> None:
    """The mistyped topic that drops a device: one sentence that says which option brings it back."""
    one = beside(recording("run_1", without=("imu/data_raw",)), "/rig/imu/data", IMU)
    (sentence,) = told(one)
    assert "no bag holds a message of /rig/imu/data_raw" in sentence
    assert "--topic imu/data_raw=/rig/imu/data " in sentence


def test_a_cell_of_another_name_is_proposed_and_others_are_not() -> None:
    one = recording("run_1", without=("cable_2/wrench",))
    one = beside(beside(one, "/rig/cabel_2/wrench", WRENCH), "/rig/hoist/wrench", WRENCH)
    missing, stranger = told(one)
    assert "--topic cable_2/wrench=/rig/cabel_2/wrench" in missing
    assert "hoist" not in missing
    assert stranger.startswith("/rig/hoist/wrench")
    assert "hoist is no cable of the rig description, which has cable_1, cable_2, cable_3" in stranger


def test_a_second_imu_is_told_once_for_all_bags() -> None:
    runs = [beside(recording(name), "/xsens/imu", IMU) for name in ("run_1", "run_2")]
    (sentence,) = told(*runs)
    assert sentence.startswith(f"/xsens/imu ({IMU}, in every bag) is not used")


@pytest.mark.parametrize(
    ("topic", "message_type"),
    [
        ("/rosout", "rcl_interfaces/msg/Log"),
        ("/rig/generalized_wrench", WRENCH),
        ("/rig/identifier/result", "std_msgs/msg/String"),
    ],
)
def test_topics_of_no_device_are_listed_without_a_warning(topic: str, message_type: str) -> None:
    one = beside(recording("run_1"), topic, message_type)
    assert told(one) == ()
    listed = accounts(one)[topic]
    assert (listed.device, listed.used, listed.count) == (None, False, 7)


def test_another_type_under_a_devices_name_is_told() -> None:
    one = beside(recording("run_1"), "/rig/imu/raw", "std_msgs/msg/Float64MultiArray")
    (sentence,) = told(one)
    assert "/rig/imu/raw (std_msgs/msg/Float64MultiArray" in sentence


def test_a_topic_without_messages_is_as_good_as_missing() -> None:
    one = recording("run_1", without=("imu/data_raw",))
    one = beside(beside(one, "/rig/imu/data_raw", IMU, count=0), "/xsens/imu", IMU, count=0)
    (sentence,) = told(one)
    assert "no bag holds a message of /rig/imu/data_raw" in sentence
    assert "--topic" not in sentence  # the other one has none either
    assert accounts(one)["/rig/imu/data_raw"].note == "has no message"


def test_a_device_that_the_description_does_not_mount_is_told() -> None:
    (sentence,) = told(recording("run_1"), rig=replace(make_rig(), imu=None))
    assert sentence.startswith("imu: the bags hold /rig/imu/data_raw, and the rig description has no imu")


def test_a_channel_that_an_examiner_left_out_is_told() -> None:
    raw = RawSession("van", make_rig(), (recording("run_1"),))
    left = replace(raw, recordings=(recording("run_1", without=("cable_3/wrench",)),))
    found = left_aside(raw, left, inventory(raw, left))
    assert found.warnings == ("/rig/cable_3/wrench is left out of run_1: a fault of the set-up says why.",)
    by_topic = {account.topic: account for account in inventory(raw, left)}
    assert not by_topic["/rig/cable_3/wrench"].used
    assert by_topic["/rig/cable_2/wrench"].used


def test_a_rig_without_load_cells_is_a_note() -> None:
    cells = tuple(f"{cable}/wrench" for cable in CABLES)
    raw = RawSession("van", make_rig(), (recording("run_1", without=cells),))
    found = left_aside(raw, raw, inventory(raw, raw))
    assert found.warnings == ()
    assert found.notes == ("No load cell is recorded: tensions tell nothing of this session.",)


def test_a_namespace_is_part_of_what_is_looked_for() -> None:
    (sentence,) = told(recording("run_1", without=("imu/data_raw",)), namespace="lab/")
    assert "no bag holds a message of /lab/imu/data_raw" in sentence


def test_the_examination_holds_the_inventory() -> None:
    one = replace(recording("run_1", without=("imu/data_raw",)), notes=("the index was missing",))
    found = examine(RawSession("van", make_rig(), (one,), notes=("a proposal",))).examination
    assert [account.topic for account in found.topics] == list(one.listed)
    assert any("no bag holds a message of /rig/imu/data_raw" in warning for warning in found.warnings)
    assert found.notes[:2] == ("a proposal", "the index was missing")


@pytest.mark.parametrize(("first", "second", "warned"), [(100.0, 0.0, True), (0.0, 100.0, False)])
def test_runs_whose_numbers_contradict_their_dates_are_told(
    first: float, second: float, warned: bool
) -> None:
    clocks = [dict.fromkeys(DEVICES, late) for late in (first, second)]
    runs = [recording(f"run_{k + 1}", "dynamic", (), **late) for k, late in enumerate(clocks)]
    said = list(out_of_order(RawSession("van", make_rig(), tuple(runs))))
    assert ["run_1 was recorded after run_2" in line for line in said] == [True] * warned


def test_runs_side_by_side_in_time_are_in_order() -> None:
    both = RawSession("van", make_rig(), (recording("run_1"), recording("run_2")))
    assert list(out_of_order(both)) == []
