"""Faults of stamps: named when they are there, undone to the true times, never told of clean recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from session_samples import make_rig

from rig_identification.check import readings
from rig_identification.check import stamps as kinds
from rig_identification.check.found import examiners
from rig_identification.check.stamps.streams import in_order
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.session.read import clean

Stamps = NDArray[np.int64]
SECOND = 1_000_000_000
START = 1_793_243_600_904_000_000
#: Field, cable, sampling interval (s) and columns of each topic.
DEVICES = {
    "/rig/cable_1/wrench": ("tension", "cable_1", 0.002, 1),
    "/rig/cable_2/wrench": ("tension", "cable_2", 0.002, 1),
    "/rig/cable_3/wrench": ("tension", "cable_3", 0.002, 1),
    "/rig/imu/data_raw": ("imu", None, 0.005, 6),
    "/rig/inclinometer/angles": ("inclination", None, 0.05, 2),
}
IMU = "/rig/imu/data_raw"


def channel(topic: str, seconds: float, start: int, rng: np.random.Generator) -> RawChannel:
    field, cable, interval, width = DEVICES[topic]
    time = rng.uniform(0.0, interval) + np.arange(0.0, seconds, interval)
    phases = rng.uniform(0.0, 6.0, width)
    values = np.sin(2.0 * np.pi * (0.7 * time[:, None] * (1.0 + 0.2 * np.arange(width)) + phases))
    values += 1e-3 * rng.normal(size=values.shape)
    stamps = start + np.round(time * SECOND).astype(np.int64)
    received = np.sort(stamps + 2_000_000 + np.round(rng.exponential(1e6, len(time))).astype(np.int64))
    return RawChannel(topic, field, "type", stamps, received, values, cable)


def session(seed: int = 0, seconds: tuple[float, ...] = (9.0, 14.0)) -> RawSession:
    """Two runs of five devices, received one to several milliseconds after they were stamped."""
    rng = np.random.default_rng(seed)
    runs = [
        RawRecording(f"run_{n}", "dynamic", False, f"run_{n}", tuple(
            channel(topic, length, START + n * 300 * SECOND, rng) for topic in DEVICES
        ))
        for n, length in enumerate(seconds)
    ]  # fmt: skip
    return RawSession("made_up", make_rig(), tuple(runs))


def with_fault(
    raw: RawSession, fault: Callable[[Stamps], Stamps], topics: tuple[str, ...] = (IMU,)
) -> RawSession:
    recordings = []
    for recording in raw.recordings:
        changed = (replace(c, stamp_ns=fault(c.stamp_ns)) for c in recording.channels if c.topic in topics)
        recordings.append(recording.with_channels(*changed))
    return replace(raw, recordings=tuple(recordings))


def examined(raw: RawSession) -> tuple[RawSession, list[SetupFault]]:
    faults = []
    for examiner in examiners(kinds):
        for found in examiner.find(raw):
            raw = found.session
            faults.append(found.fault)
    return raw, faults


def errors(raw: RawSession, corrected: RawSession, topic: str = IMU) -> NDArray[np.float64]:
    """s, by which the corrected stamps of a topic lie after the true ones, of all recordings."""
    pairs = []
    for true, got in zip(raw.recordings, corrected.recordings, strict=True):
        stamps = [next(c.stamp_ns for c in r.channels if c.topic == topic) for r in (true, got)]
        pairs.append((stamps[1] - stamps[0]) / SECOND)
    return np.concatenate(pairs)


def unpadded(stamps: Stamps) -> Stamps:
    return np.array([s // SECOND * SECOND + int(f"{s % SECOND}".ljust(9, "0")) for s in stamps.tolist()])


def run_together(stamps: Stamps) -> Stamps:
    return np.array([int(f"{s // SECOND}{s % SECOND}") for s in stamps.tolist()])


def low_nanoseconds(stamps: Stamps) -> Stamps:
    return stamps // SECOND * SECOND + stamps % 2**32


def negative_halves(stamps: Stamps) -> Stamps:
    return np.where(stamps % SECOND >= SECOND // 2, stamps - SECOND, stamps)


def step(size: float) -> Callable[[Stamps], Stamps]:
    def fault(stamps: Stamps) -> Stamps:
        first = START + round((stamps[0] - START) / (300 * SECOND)) * 300 * SECOND
        return np.where(stamps > first + 4 * SECOND, stamps + round(size * SECOND), stamps)

    return fault


def fast(ppm: float) -> Callable[[Stamps], Stamps]:
    return lambda s: s[0] + np.round((s - s[0]) * (1.0 + 1e-6 * ppm)).astype(np.int64)


def on_arrival(stamps: Stamps) -> Stamps:
    late = np.random.default_rng(len(stamps)).exponential(0.002, len(stamps))
    return np.maximum.accumulate(stamps + np.round(late * SECOND).astype(np.int64))


def in_bursts(stamps: Stamps, wait: float = 0.016) -> Stamps:
    """Handed over every 16 ms or so, and once after 0.1 s, sample after sample 70 us apart."""
    rng = np.random.default_rng(len(stamps))
    waits = wait + 3e-4 * rng.normal(size=2000)
    waits[300] = 0.1
    handovers = stamps[0] - SECOND // 100 + np.round(np.cumsum(waits) * SECOND).astype(np.int64)
    turn = np.searchsorted(handovers, stamps)
    firsts = np.searchsorted(turn, turn)
    return handovers[turn] + 70_000 * (np.arange(len(stamps)) - firsts)


#: Kind, fault, and by how much (s) the corrected stamps may be off.
FAULTS: dict[str, tuple[str, Callable[[Stamps], Stamps], float]] = {
    "32 bits": ("nanoseconds_overflow", lambda s: s % 2**32, 1e-9),
    "32 bits, signed": ("nanoseconds_overflow", lambda s: (s + 2**31) % 2**32 - 2**31, 1e-9),
    "low 32 bits beside seconds": ("nanoseconds_overflow", low_nanoseconds, 1e-9),
    "negative fractions": ("nanoseconds_overflow", negative_halves, 1e-9),
    "no leading zeros": ("nanoseconds_unpadded", unpadded, 1e-9),
    "one number": ("nanoseconds_unpadded", run_together, 1e-9),
    "TAI": ("leap_seconds", lambda s: s + 37 * SECOND, 1e-9),
    "GPS": ("leap_seconds", lambda s: s + 18 * SECOND, 1e-9),
    "zone": ("leap_seconds", lambda s: s - 7200 * SECOND, 1e-9),
    "since boot": ("other_clock", lambda s: s - START + 5321 * SECOND, 1e-3),
    "unsynchronized": ("other_clock", lambda s: s + 2_345_678_901, 1e-3),
    "simulated": ("simulated_stamps", lambda s: s - s[0] + 1, 1e-3),
    "never set": ("zero_stamps", np.zeros_like, 1e-3),
    "step on": ("clock_step", step(0.3), 1e-3),
    "step back": ("clock_step", step(-0.3), 1e-3),
    "a small step": ("clock_step", step(0.03), 1e-3),
    "fast": ("clock_drift", fast(1000.0), 1e-3),
    "slow": ("clock_drift", fast(-300.0), 1e-3),
    "arrival": ("arrival_time", on_arrival, 1e-3),
    "bursts": ("usb_bursts", in_bursts, 2e-3),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_one_device_is_named_and_undone(name: str) -> None:
    kind, fault, tolerance = FAULTS[name]
    raw = session()
    corrected, faults = examined(with_fault(raw, fault))
    assert [(f.effect, f.where["kind"], f.where["channel"]) for f in faults] == [("stamp_error", kind, "imu")]
    assert faults[0].corrected
    assert faults[0].statement.startswith("The IMU's ")
    assert faults[0].statement.endswith(".")
    assert all(set(number) == {"value", "std", "unit"} for number in faults[0].parameters.values())
    assert faults[0].where["recordings"] == ["run_0", "run_1"]
    assert np.abs(errors(raw, corrected)).max() < tolerance
    clean(corrected)


@pytest.mark.parametrize(
    "name", ["32 bits", "no leading zeros", "never set", "step on", "step back", "arrival"]
)
def test_a_fault_of_all_devices_is_one(name: str) -> None:
    kind, fault, tolerance = FAULTS[name]
    raw = session()
    corrected, faults = examined(with_fault(raw, fault, tuple(DEVICES)))
    assert [(f.where["kind"], f.where["channel"]) for f in faults] == [(kind, "all")]
    apart = [np.median(errors(raw, corrected, topic)) for topic in DEVICES]
    assert np.ptp(apart) < max(2.0 * tolerance, 1e-9)


def test_a_logger_on_other_clock_is_told_once() -> None:
    raw = session()
    topics = ("/rig/cable_1/wrench", "/rig/cable_2/wrench", "/rig/cable_3/wrench")
    corrected, (fault,) = examined(with_fault(raw, lambda s: s + 37 * SECOND, topics))
    assert fault.where["channel"] == "cable_1, cable_2, cable_3"
    assert fault.parameters["offset"] == {"value": 37.0, "std": 0.0, "unit": "s"}
    assert not errors(raw, corrected, topics[0]).any()


@pytest.mark.parametrize("wait", [0.008, 0.064])
def test_bursts_of_a_quick_device_are_undone(wait: float) -> None:
    """Of long bursts nearly every step is as short as the others: even steps are not regular stamps."""
    raw, cell = session(), "/rig/cable_2/wrench"
    corrected, (fault,) = examined(with_fault(raw, lambda s: in_bursts(s, wait), (cell,)))
    assert (fault.where["kind"], fault.where["channel"]) == ("usb_bursts", "cable_2")
    late = errors(raw, corrected, cell)
    assert np.ptp(late) < 2e-3
    assert np.abs(late).max() < wait


def measured_at(one: RawChannel, stamps: Stamps) -> NDArray[np.float64]:
    """(n, width) what a device would have measured at other times, ns."""
    return np.asarray(CubicSpline(one.stamp_ns - one.stamp_ns[0], one.values)(stamps - one.stamp_ns[0]))


@pytest.mark.parametrize("most", [0.0002, 0.001])
def test_values_tell_stamps_that_jitter_from_a_device_that_measures_unevenly(most: float) -> None:
    """A host stamps early or late, and some samples are lost; or the device measures when it is stamped."""
    rng = np.random.default_rng(5)

    def jittering(stamps: Stamps) -> Stamps:
        return stamps + np.round(rng.uniform(-most, most, len(stamps)) * SECOND).astype(np.int64)

    even, uneven, true = [], [], []
    for recording in session().recordings:
        old = next(c for c in recording.channels if c.topic == IMU)
        kept = rng.random(len(old.stamp_ns)) > 0.02
        stamps = jittering(old.stamp_ns)
        lost = replace(old, stamp_ns=stamps[kept], received_ns=old.received_ns[kept], values=old.values[kept])
        right = replace(lost, values=measured_at(old, stamps)[kept])
        true.append(recording.with_channels(replace(lost, stamp_ns=old.stamp_ns[kept])))
        even.append(recording.with_channels(lost))
        uneven.append(recording.with_channels(right))
    raw = session()
    corrected, (fault,) = examined(replace(raw, recordings=tuple(even)))
    assert (fault.where["kind"], fault.where["channel"]) == ("jitter", "imu")
    assert fault.parameters["jitter"]["value"] == pytest.approx(most / 3.0**0.5, rel=0.1)
    assert fault.parameters["lost"]["value"] == pytest.approx(0.02, rel=0.5)
    off = errors(replace(raw, recordings=tuple(true)), corrected)
    assert np.std(off) < 0.1 * most
    assert examined(replace(raw, recordings=tuple(uneven)))[1] == []


@pytest.mark.parametrize("poll", [0.008, 0.013, 0.032])
def test_values_tell_a_polled_device_from_one_that_measures_at_ticks(poll: float) -> None:
    """Both have the same stamps; what is measured at even times is off the motion at those of the polls."""
    topic, ticks = "/rig/inclinometer/angles", round(poll * SECOND)

    def polled(stamps: Stamps) -> Stamps:
        return -(-stamps // ticks) * ticks

    raw = session()
    corrected, (fault,) = examined(with_fault(raw, polled, (topic,)))
    assert (fault.where["kind"], fault.where["channel"]) == ("usb_bursts", "inclinometer")
    assert np.std(errors(raw, corrected, topic)) < 1e-3
    recordings = []
    for recording in raw.recordings:
        old = next(c for c in recording.channels if c.topic == topic)
        stamps = polled(old.stamp_ns)
        recordings.append(
            recording.with_channels(replace(old, stamp_ns=stamps, values=measured_at(old, stamps)))
        )
    assert examined(replace(raw, recordings=tuple(recordings)))[1] == []


@pytest.mark.parametrize("size", [0.05, 0.3, 20.0])
def test_a_step_of_the_host_is_no_pause(size: float) -> None:
    """Receipts step along: the values alone tell that no time went by; after a pause they are others."""
    raw = session()
    run = raw.recordings[0]
    at = int(run.channels[0].stamp_ns[2000])

    def on(stamps: Stamps) -> Stamps:
        return stamps + np.where(stamps >= at, round(size * SECOND), 0)

    stepped = tuple(replace(c, stamp_ns=on(c.stamp_ns), received_ns=on(c.received_ns)) for c in run.channels)
    corrected, (fault,) = examined(
        replace(raw, recordings=(replace(run, channels=stepped), raw.recordings[1]))
    )
    assert (fault.where["kind"], fault.where["channel"]) == ("clock_step", "all")
    assert fault.parameters["offset"]["value"] == pytest.approx(size, abs=1e-3)
    assert np.ptp(errors(raw, corrected)) < 1e-3

    kept = (np.abs(c.stamp_ns - at - size / 2 * SECOND) > size / 2 * SECOND for c in run.channels)
    paused = tuple(
        replace(c, stamp_ns=c.stamp_ns[k], received_ns=c.received_ns[k], values=c.values[k])
        for c, k in zip(run.channels, kept, strict=True)
    )
    assert examined(replace(raw, recordings=(replace(run, channels=paused), raw.recordings[1])))[1] == []


@pytest.mark.parametrize(
    ("shift", "kind"),
    [(37.0, "leap_seconds"), (-7200.0, "leap_seconds"), (-START / SECOND + 20.0, "simulated_stamps")],
)
def test_devices_on_another_clock_than_the_recorder(shift: float, kind: str) -> None:
    raw = with_fault(session(), lambda s: s + round(shift) * SECOND, tuple(DEVICES))
    corrected, (fault,) = examined(raw)
    assert (fault.where["kind"], fault.where["channel"]) == (kind, "all")
    assert not errors(raw, corrected).any()


@pytest.mark.parametrize("shifts", [(5000.0, 5000.0), (37.0, 1234.0), (900.0, 2700.0)])
def test_bags_recorded_anew_from_others_are_ordinary(shifts: tuple[float, float]) -> None:
    """A recorder of a replay receives at another time, each bag at its own."""
    raw = session()
    recordings = tuple(
        replace(
            r, channels=tuple(replace(c, received_ns=c.received_ns + round(s * SECOND)) for c in r.channels)
        )
        for r, s in zip(raw.recordings, shifts, strict=True)
    )
    assert examined(replace(raw, recordings=recordings))[1] == []


def test_messages_in_reverse_order_are_turned_round() -> None:
    raw = session()
    run = raw.recordings[0]
    turned = [
        replace(c, stamp_ns=c.stamp_ns[::-1], values=c.values[::-1]) for c in run.channels if c.topic == IMU
    ]
    corrected, (fault,) = examined(replace(raw, recordings=(run.with_channels(*turned), raw.recordings[1])))
    assert (fault.where["kind"], fault.where["recordings"]) == ("backwards", ["run_0"])
    assert not errors(raw, corrected).any()
    np.testing.assert_array_equal(corrected.recordings[0].channel("imu").values, run.channel("imu").values)  # type: ignore[union-attr]


def test_a_message_that_overtakes_another_one_is_no_spike() -> None:
    """Samples are read in the order of measurement, however they arrived."""

    def found(raw: RawSession) -> list[SetupFault]:
        return [f.fault for examiner in examiners(readings) for f in examiner.find(raw)]

    overtaken = []
    for recording in session().recordings:
        one = next(c for c in recording.channels if c.topic == IMU)
        order = np.arange(len(one.stamp_ns))
        order[[1000, 1001]] = order[[1001, 1000]]
        moved = replace(one, stamp_ns=one.stamp_ns[order], values=one.values[order])
        overtaken.append(recording.with_channels(moved))
    raw = replace(session(), recordings=tuple(overtaken))
    assert found(in_order(raw)) == []
    assert found(raw) != []
    for right, sorted_again in zip(session().recordings, in_order(raw).recordings, strict=True):
        for a, b in zip(right.channels, sorted_again.channels, strict=True):
            np.testing.assert_array_equal(a.values, b.values)


def test_a_device_without_any_times_is_left_out() -> None:
    raw = with_fault(session(), np.zeros_like)
    recordings = tuple(
        r.with_channels(*(replace(c, received_ns=c.stamp_ns) for c in r.channels if c.topic == IMU))
        for r in raw.recordings
    )
    corrected, (fault,) = examined(replace(raw, recordings=recordings))
    assert (fault.where["kind"], fault.corrected) == ("zero_stamps", False)
    assert all(recording.channel("imu") is None for recording in corrected.recordings)
    clean(corrected)


@pytest.mark.parametrize(
    "name", ["32 bits", "no leading zeros", "TAI", "since boot", "step back", "step on", "a small step"]
)
def test_copies_of_the_stamps_for_receive_times_mislead_nobody(name: str) -> None:
    kind, fault, _ = FAULTS[name]
    raw = session()
    wrong = with_fault(raw, fault)
    recordings = tuple(
        replace(r, channels=tuple(replace(c, received_ns=c.stamp_ns + 2_000_000) for c in r.channels))
        for r in wrong.recordings
    )
    corrected, faults = examined(replace(wrong, recordings=recordings))
    assert [f.where["kind"] for f in faults] == [kind]
    assert np.abs(errors(raw, corrected)).max() < 0.1  # start and end of the recording tell no better


def test_a_rate_that_only_copies_could_tell_is_not_told() -> None:
    wrong = with_fault(session(), fast(300.0))
    recordings = tuple(
        replace(r, channels=tuple(replace(c, received_ns=c.stamp_ns + 2_000_000) for c in r.channels))
        for r in wrong.recordings
    )
    assert examined(replace(wrong, recordings=recordings))[1] == []


def ordinary(seed: int) -> RawSession:
    """A session as devices give it: losses, gaps, jitter, parts, repeats, drift of 20 ppm, rounding."""
    rng = np.random.default_rng(seed)
    raw = session(seed, (2.5, 4.0))
    manners = {}
    for topic, (_, _, interval, _) in DEVICES.items():
        manners[topic] = (
            interval, rng.choice([0.0, 0.05, 0.2]), rng.choice([0.0, 0.01, 0.05, 0.1]), rng.normal(0.0, 2e-5),
            rng.choice([1, 1000, 1_000_000]), bool(rng.random() < 0.5),
        )  # fmt: skip
    copies = rng.choice(["real", "copied", "converted"])
    recordings = []
    for recording in raw.recordings:
        channels = tuple(_as_devices_do(c, *manners[c.topic], copies, rng) for c in recording.channels)
        recordings.append(replace(recording, channels=channels))
    return replace(raw, recordings=tuple(recordings))


def _as_devices_do(
    one: RawChannel, interval: float, jitter: float, lost: float, rate: float, rounding: int, even: bool,
    receipt: str, rng: np.random.Generator,
) -> RawChannel:  # fmt: skip
    count = len(one.stamp_ns)
    off = rng.uniform(-1.7, 1.7, count) if even else rng.normal(size=count)
    stamps = one.stamp_ns + np.round((off * jitter * interval) * SECOND).astype(np.int64)
    stamps += np.round(rate * (stamps - stamps[0])).astype(np.int64)
    stamps = stamps // rounding * rounding
    # It measures when it stamps, as unevenly as it does
    one = replace(one, values=measured_at(one, stamps))
    received = one.received_ns
    if receipt != "real":
        received = stamps + 2_000_000 if receipt == "copied" else START + (stamps - START) // 20
    kept = rng.random(count) >= lost
    first, last = (int(count * rng.choice([0.0, 0.0, 0.3])), count - int(count * rng.choice([0.0, 0.0, 0.2])))
    kept[:first] = kept[last:] = False
    gap = rng.integers(0, count)
    kept[gap : gap + int(rng.choice([0, 1, 20, 0.1 * count]))] = False
    index = np.flatnonzero(kept)
    if rng.random() < 0.2:
        index = np.sort(np.concatenate((index, rng.choice(index, len(index) // 50))))
    if rng.random() < 0.2:
        swapped = rng.choice(len(index) - 1, len(index) // 40)
        index[swapped], index[swapped + 1] = index[swapped + 1], index[swapped].copy()
    return replace(one, stamp_ns=stamps[index], received_ns=received[index], values=one.values[index])


def test_nothing_is_told_of_a_thousand_ordinary_streams() -> None:
    told = {seed: examined(ordinary(seed))[1] for seed in range(100)}  # ten streams each
    assert {seed: [f.statement for f in faults] for seed, faults in told.items() if faults} == {}


def test_a_slow_drift_is_ordinary() -> None:
    assert examined(with_fault(session(), fast(40.0)))[1] == []


@pytest.mark.parametrize("offset", [-0.3, -0.01, 0.01, 0.3])
def test_an_offset_that_a_latency_may_be_is_left_to_the_fit(offset: float) -> None:
    assert examined(with_fault(session(), lambda s: s + round(offset * SECOND)))[1] == []


def test_a_gap_of_one_device_is_no_step() -> None:
    raw = session()
    recordings = []
    for recording in raw.recordings:
        imu = recording.channel("imu")
        assert imu is not None
        kept = np.r_[0:600, 900 : len(imu.stamp_ns)]
        recordings.append(recording.with_channels(replace(
            imu, stamp_ns=imu.stamp_ns[kept], received_ns=imu.received_ns[kept], values=imu.values[kept]
        )))  # fmt: skip
    assert examined(replace(raw, recordings=tuple(recordings)))[1] == []
