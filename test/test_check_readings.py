"""Faults that one channel's readings show by themselves: put in, found, undone; and none where none is."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from session_samples import make_rig

from rig_identification.check import readings
from rig_identification.check.examine import examine
from rig_identification.check.found import examiners
from rig_identification.check.readings import coarse_steps
from rig_identification.check.readings.averages_undone import averaged, spread, undone
from rig_identification.examination import SetupFault
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.session import read_raw
from rig_identification.session.read import clean

RECORDINGS = Path(
    os.environ.get(
        "RIG_IDENTIFICATION_RECORDINGS", Path(__file__).resolve().parents[2] / "shared" / "recordings"
    )
)
SESSIONS = sorted(file.parent for file in RECORDINGS.glob("*/session.yaml"))
START_NS = 1_793_243_600_000_000_000
RATE, NOISE = 500.0, 2.0  # Hz, N: a load cell's
CELLS = ("cable_1", "cable_2", "cable_3")
Change = Callable[[np.ndarray], np.ndarray]


def channel(name: str, device: str, values: np.ndarray, rate: float = RATE, begun: float = 0.0) -> RawChannel:
    """Even stamps; ``name`` is the channel's, ``device`` a cable or the channel's topic."""
    stamps = START_NS + np.round((begun + np.arange(len(values)) / rate) * 1e9).astype(np.int64)
    cable = device if name == "tension" else None
    columns = values.reshape(len(values), -1)
    return RawChannel(f"/rig/{device}", name, "", stamps, stamps, columns, cable)


def swing(seconds: float, rate: float, frequency: float = 0.7, phase: float = 0.0) -> np.ndarray:
    """A swing and its second harmonic, amplitude 1."""
    angle = 2.0 * np.pi * frequency * np.arange(round(seconds * rate)) / rate + phase
    return np.sin(angle) + 0.1 * np.cos(2.0 * angle)


def make_raw(
    seed: int = 1, *, noise: float = 1.0, step: float = 1.0 / 64.0, seconds: float = 12.0
) -> RawSession:
    """Rest and two runs of three cells, an IMU and an inclinometer.

    noise: of all sensors, times their ordinary one; step: of the cells' converter in N, the others' alike.
    """
    rng = np.random.default_rng(seed)
    recordings = []
    for name, kind, size in (("rest", "static", 0.0), ("run_1", "dynamic", 1.0), ("run_2", "dynamic", 0.6)):

        def measured(
            mean: float, scale: float, std: float, rate: float, width: int, size: float = size
        ) -> np.ndarray:
            signal = [mean + size * scale * swing(seconds, rate, 0.7 + 0.2 * k, k) for k in range(width)]
            values = np.array(signal).T + noise * std * rng.normal(size=(round(seconds * rate), width))
            grain = step * std / NOISE
            return np.round(values / grain) * grain if step else values

        channels = [channel("tension", c, measured(4000.0, 600.0, NOISE, RATE, 1)) for c in CELLS]
        rates, forces = measured(0.0, 0.3, 3e-4, 200.0, 3), measured(5.6, 0.5, 1e-2, 200.0, 3)
        channels.append(channel("imu", "imu", np.hstack((rates, forces)), 200.0))
        channels.append(channel("inclination", "inclinometer", measured(0.02, 0.05, 3e-4, 50.0, 2), 50.0))
        recordings.append(RawRecording(name, kind, False, name, tuple(channels)))
    return RawSession("made", make_rig(), tuple(recordings))


def changed(raw: RawSession, device: str, change: Change, *, only: str | None = None) -> RawSession:
    """The session with the values of one device changed, in all recordings or ``only`` one."""
    recordings = []
    for recording in raw.recordings:
        old = recording.channel(device)
        assert old is not None
        new = dataclasses.replace(old, values=change(np.array(old.values)))
        recordings.append(recording.with_channels(new) if only in (None, recording.name) else recording)
    return dataclasses.replace(raw, recordings=tuple(recordings))


def examined(raw: RawSession) -> tuple[list[SetupFault], RawSession]:
    """All faults that the examiners tell, and the session as they leave it."""
    faults = []
    for examiner in examiners(readings):
        for found in examiner.find(raw):
            raw = found.session
            faults.append(found.fault)
    return faults, raw


def the_one(raw: RawSession, effect: str, device: str) -> tuple[SetupFault, RawSession]:
    """The single fault that is told, of this effect and device, and the corrected session."""
    faults, corrected = examined(raw)
    assert [(fault.effect, fault.where["channel"]) for fault in faults] == [(effect, device)]
    assert faults[0].gain > 13.8  # nats: a false alarm of one in a million
    return faults[0], corrected


def kept(raw: RawSession, corrected: RawSession, device: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """(n,) which samples of a recording are left, and their values (k, width), by their stamps."""
    before, after = (one.recordings[[r.name for r in raw.recordings].index(name)] for one in (raw, corrected))
    old, new = before.channel(device), after.channel(device)
    assert old is not None
    assert new is not None
    finite = np.isfinite(new.values).all(axis=1)
    return np.isin(old.stamp_ns, new.stamp_ns[finite]), new.values[finite]


def original(raw: RawSession, device: str, name: str) -> np.ndarray:
    """(n, width) values of a device."""
    found = next(r for r in raw.recordings if r.name == name).channel(device)
    assert found is not None
    return found.values


def held(samples: float) -> Change:
    """Each value repeated over ``samples`` of them."""
    return lambda v: v[(np.ceil(np.floor(np.arange(len(v)) / samples) * samples)).astype(int)]


@pytest.mark.parametrize("samples", [1.25, 2.0, 6.25, 50.0])
def test_held_samples_keep_the_first_of_each(samples: float) -> None:
    raw = make_raw()
    fault, corrected = the_one(changed(raw, "cable_2", held(samples)), "held_samples", "cable_2")
    assert fault.parameters["rate"]["value"] == pytest.approx(RATE / samples, rel=0.01)
    left, values = kept(raw, corrected, "cable_2", "run_1")
    assert np.count_nonzero(left) == pytest.approx(len(left) / samples, rel=0.02)
    # Below two samples a hold's end is known to one sample where two held values are the same by chance
    same = np.mean(values == original(raw, "cable_2", "run_1")[left])
    assert same == 1.0 if samples >= 2.0 else same > 0.999


def test_a_compressed_film_shows_its_pictures_again() -> None:
    """A camera of 15.07 Hz in a film of 30: pictures repeat to within what the coder makes of them.

    Stamps count the film's pictures. One picture of the camera is lost, and the one before it shown on.
    """
    seconds, camera, film = 14.0, 15.07, 30.0
    shown = np.arange(round(seconds * film))
    taken = np.ceil(shown / film * camera - 1e-9).astype(int)
    taken[taken == 95] = 94
    rng = np.random.default_rng(3)
    jitter = 2e-4 * rng.normal(size=taken.max() + 1)
    angle = 0.12 * np.sin(2.0 * np.pi * 1.146 * taken / camera + 0.5) + jitter[taken]
    angle = angle + 1e-5 * rng.normal(size=angle.size)
    pose = np.zeros((angle.size, 7))
    pose[:, 5], pose[:, 6] = np.sin(0.5 * angle), np.cos(0.5 * angle)
    run = RawRecording("run_1", "dynamic", False, "run_1", (channel("mocap", "mocap/pose", pose, film),))
    fault, corrected = the_one(RawSession("film", make_rig(), (run,)), "held_samples", "mocap")
    assert fault.parameters["rate"]["value"] == pytest.approx(camera, rel=0.02)
    left = corrected.recordings[0].channels[0]
    # Where the swing turns back two pictures may be alike by chance
    assert len(left.stamp_ns) >= 205
    picture = (left.stamp_ns - left.stamp_ns[0]) / 1e9 * camera
    # As they were, stamps are half a picture off where the camera's clock and the film's slip by one
    assert np.max(np.abs(picture - np.round(picture))) < 0.25
    assert np.count_nonzero(np.diff(np.round(picture)) == 1.0) >= 200


def test_an_accelerometer_slower_than_its_gyroscope_is_held() -> None:
    def slower(values: np.ndarray) -> np.ndarray:
        values[:, 3:] = held(4.0)(values[:, 3:])
        return values

    raw = make_raw()
    fault, corrected = the_one(changed(raw, "imu", slower), "held_samples", "imu")
    assert fault.parameters["rate"]["value"] == pytest.approx(50.0, rel=0.01)
    left, values = kept(raw, corrected, "imu", "run_1")
    np.testing.assert_array_equal(values, original(raw, "imu", "run_1")[left])


def test_a_cell_on_the_channel_of_another_is_not_frozen() -> None:
    """Its publisher starts first, and repeats the first reading until the second comes."""
    raw = make_raw()
    recordings = []
    for recording in raw.recordings:
        source = recording.channel("cable_1")
        assert source is not None
        first = np.repeat(source.values[:1], 8, axis=0)
        begun = source.stamp_ns[:8] - 8 * (source.stamp_ns[1] - source.stamp_ns[0])
        stamps = np.concatenate((begun, source.stamp_ns))
        copy = RawChannel(
            "/rig/cable_2", "tension", "", stamps, stamps, np.vstack((first, source.values)), "cable_2"
        )
        recordings.append(recording.with_channels(copy))
    faults = examine(dataclasses.replace(raw, recordings=tuple(recordings))).examination.faults
    assert faults[0].effect == "wiring"
    assert faults[0].where["channel"] == ["cable_1", "cable_2"]
    assert not {"frozen_channel", "held_samples"} & {fault.effect for fault in faults}


def test_cells_of_one_logger_are_one_fault() -> None:
    raw = make_raw()
    for cell in CELLS:
        raw = changed(raw, cell, held(5.0))
    faults, _ = examined(raw)
    assert [fault.where["channel"] for fault in faults] == [list(CELLS)]
    assert faults[0].where["recordings"] == ["rest", "run_1", "run_2"]


@pytest.mark.parametrize("span", [2.0**16 / 64.0, 700.0])
@pytest.mark.parametrize("top", [4000.0, 4300.0])
def test_wrapped_counts_are_unwrapped(span: float, top: float) -> None:
    raw = make_raw()
    wrapped = changed(raw, "cable_3", lambda v: (v - top) % span + top - span)
    fault, corrected = the_one(wrapped, "wrapped_counts", "cable_3")
    assert fault.parameters["span"]["value"] == pytest.approx(span, rel=1e-3)
    for name in ("run_1", "run_2"):
        left, values = kept(raw, corrected, "cable_3", name)
        assert left.all()
        np.testing.assert_allclose(values, original(raw, "cable_3", name), atol=1e-3 * span)


def test_a_force_read_without_its_sign_is_unwrapped() -> None:
    raw = make_raw()
    force = 50.0 * np.stack([swing(12.0, RATE, 1.1, k) for k in range(3)], axis=1)
    force = np.round((force + 0.5 * np.random.default_rng(5).normal(size=force.shape)) * 256.0) / 256.0
    unsigned = np.where(force < 0.0, force + 256.0, force)
    run = raw.recordings[1]
    run = dataclasses.replace(run, channels=(*run.channels, channel("exciter_force", "exciter", unsigned)))
    faults, corrected = examined(dataclasses.replace(raw, recordings=(raw.recordings[0], run)))
    assert [(f.effect, f.where["channel"], f.where["axis"]) for f in faults] == [
        ("wrapped_counts", "exciter", axis) for axis in "xyz"
    ]
    np.testing.assert_allclose(original(corrected, "exciter", "run_1"), force, atol=0.1)


@pytest.mark.parametrize("device", ["cable_1", "imu", "inclinometer"])
def test_a_frozen_channel_is_left_out_from_there(device: str) -> None:
    def frozen(values: np.ndarray) -> np.ndarray:
        values[len(values) // 3 :] = values[len(values) // 3]
        return values

    raw = make_raw()
    fault, corrected = the_one(changed(raw, device, frozen, only="run_1"), "frozen_channel", device)
    left, values = kept(raw, corrected, device, "run_1")
    assert fault.where["recordings"] == ["run_1"]
    assert fault.where["times"] == [
        {"recording": "run_1", "start": pytest.approx(4.0, abs=0.05), "end": pytest.approx(12.0, abs=0.05)}
    ]
    assert np.flatnonzero(left)[-1] == len(left) // 3
    np.testing.assert_array_equal(values, original(raw, device, "run_1")[left])


def test_a_cell_that_never_changes_while_the_body_moves_is_left_out() -> None:
    raw = changed(make_raw(), "cable_1", lambda v: np.full_like(v, 4000.0))
    fault, corrected = the_one(raw, "frozen_channel", "cable_1")
    assert not fault.corrected
    assert fault.where["recordings"] == ["run_1", "run_2"]
    assert "cable_1" not in clean(corrected).recordings[1].tension


@pytest.mark.parametrize("length", [1, 40])
def test_gaps_filled_with_zeros_are_left_out(length: int) -> None:
    def filled(values: np.ndarray) -> np.ndarray:
        for k in (500, 1500, 2200):
            values[k : k + length] = 0.0
        return values

    raw = make_raw()
    fault, corrected = the_one(changed(raw, "cable_2", filled), "zero_filled", "cable_2")
    assert fault.parameters["count"]["value"] == 9 * length
    left, values = kept(raw, corrected, "cable_2", "run_2")
    assert np.count_nonzero(~left) == 3 * length
    np.testing.assert_array_equal(values, original(raw, "cable_2", "run_2")[left])


@pytest.mark.parametrize(("width", "size"), [(1, 15.0), (1, 1000.0), (3, 40.0)])
def test_spikes_are_left_out(width: int, size: float) -> None:
    rng = np.random.default_rng(3)

    def spiked(values: np.ndarray) -> np.ndarray:
        for k in 50 * (1 + rng.choice(len(values) // 50 - 2, 12, replace=False)):
            values[k : k + width] += size * NOISE * rng.choice([-1.0, 1.0])
        return values

    raw = make_raw()
    fault, corrected = the_one(changed(raw, "cable_1", spiked, only="run_1"), "spikes", "cable_1")
    assert fault.parameters["count"]["value"] == 12
    left, values = kept(raw, corrected, "cable_1", "run_1")
    assert np.count_nonzero(~left) == 12 * width
    np.testing.assert_array_equal(values, original(raw, "cable_1", "run_1")[left])


def test_many_spikes_in_all_cells_are_no_blows() -> None:
    """One sample in twenty of each cell: most fall beside one of another cell, as chance has it."""
    rng, raw = np.random.default_rng(6), make_raw()
    spiked = raw
    for cell in CELLS:

        def doubled(values: np.ndarray) -> np.ndarray:
            values[rng.choice(len(values), len(values) // 20, replace=False)] *= 2.0
            return values

        spiked = changed(spiked, cell, doubled)
    (fault,), corrected = examined(spiked)
    assert (fault.effect, fault.where["channel"]) == ("spikes", list(CELLS))
    for cell in CELLS:
        left, values = kept(raw, corrected, cell, "run_2")
        wrong = np.abs(values - original(raw, cell, "run_2")[left])[:, 0] > 1000.0
        assert np.mean(left) > 0.9
        assert np.mean(wrong) < 0.005  # of 0.05 before: pairs side by side are missed now and then


@pytest.mark.parametrize("beside", [("cable_2",), ("cable_2", "imu")])
def test_blows_that_others_feel_are_no_spikes(beside: tuple[str, ...]) -> None:
    """A loose mass knocks: one sample in each device, at one time."""
    times = np.random.default_rng(4).uniform(1.0, 11.0, 9)
    raw = make_raw()
    for device in ("cable_1", *beside):
        rate, size = (200.0, 3.0) if device == "imu" else (RATE, 200.0)

        def struck(values: np.ndarray, rate: float = rate, size: float = size) -> np.ndarray:
            values[np.round(times * rate).astype(int), -1] += size
            return values

        raw = changed(raw, device, struck, only="run_1")
    assert examined(raw)[0] == []


def test_a_blow_that_rings_is_no_spike() -> None:
    def rung(values: np.ndarray) -> np.ndarray:
        time = np.arange(len(values)) / RATE
        for start in (1.2, 3.7, 8.1):
            after = np.maximum(time - start, 0.0)
            values[:, 0] += 200.0 * np.exp(-after / 0.02) * np.cos(2.0 * np.pi * 60.0 * after) * (after > 0.0)
        return values

    assert examined(changed(make_raw(), "cable_1", rung, only="run_1"))[0] == []


@pytest.mark.parametrize("window", [0.02, 0.2])
def test_a_running_average_is_undone(window: float) -> None:
    samples = round(window * RATE)

    def mean(values: np.ndarray) -> np.ndarray:
        before = np.concatenate((np.repeat(values[:1], samples - 1, axis=0), values))[:, 0]
        return np.round(averaged(before, samples) * 64.0)[:, None] / 64.0

    raw = make_raw()
    fault, corrected = the_one(changed(raw, "cable_2", mean), "averaged_samples", "cable_2")
    assert fault.parameters["window"]["value"] == pytest.approx(window)
    assert fault.parameters["delay"]["value"] == pytest.approx(window / 2.0)
    left, values = kept(raw, corrected, "cable_2", "run_1")
    assert np.mean(left) > 0.9
    # What is not known of the noise at the average's nulls stays below the noise
    error = values - original(raw, "cable_2", "run_1")[left]
    assert np.std(error) < 0.6 * NOISE
    assert abs(np.mean(error)) < 0.1 * NOISE
    truth = np.array(4000.0 + 600.0 * swing(12.0, RATE))[left]
    noise = values[:, 0] - truth
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.15
    assert np.std(noise) == pytest.approx(NOISE, rel=0.15)


def test_an_average_over_most_of_a_swing_leaves_the_run_out() -> None:
    def mean(values: np.ndarray) -> np.ndarray:
        before = np.concatenate((np.repeat(values[:1], 299, axis=0), values))[:, 0]
        return averaged(before, 300)[:, None]

    raw = make_raw(seconds=30.0)
    fault, corrected = the_one(changed(raw, "cable_2", mean), "averaged_samples", "cable_2")
    left, _ = kept(raw, corrected, "cable_2", "run_1")
    assert not left.any()
    assert "left out" in fault.statement
    left, _ = kept(raw, corrected, "cable_2", "rest")
    assert left.any()


def test_averaging_and_its_transpose() -> None:
    rng = np.random.default_rng(2)
    for samples in (4, 7):
        x, y = rng.normal(size=40), rng.normal(size=41 - samples)
        means = [np.mean(x[k : k + samples]) for k in range(len(y))]
        np.testing.assert_allclose(averaged(x, samples), means, atol=1e-12)
        assert y @ averaged(x, samples) == pytest.approx(spread(y, samples) @ x)


def test_what_is_undone_averages_to_what_was_read() -> None:
    rng = np.random.default_rng(2)
    read = averaged(4000.0 + 600.0 * swing(6.0, RATE) + rng.normal(size=3000), 20)
    again = averaged(undone(read, 20, 1e-8), 20)
    np.testing.assert_allclose(again[50:], read[69:], atol=1e-3)


def test_saturation_is_told_and_left_to_cleaning() -> None:
    raw = changed(make_raw(), "cable_1", lambda v: np.minimum(v, 4400.0))
    fault, corrected = the_one(raw, "saturation", "cable_1")
    assert fault.parameters["limit"] == {"value": 4400.0, "std": 0.0, "unit": "N"}
    assert corrected == raw


def test_rest_at_the_end_of_the_range_is_left_out() -> None:
    raw = changed(make_raw(), "cable_1", lambda v: np.minimum(v, 3900.0))
    fault, corrected = the_one(raw, "saturation", "cable_1")
    assert fault.where["recordings"] == ["run_1", "run_2", "rest"]
    assert not kept(raw, corrected, "cable_1", "rest")[0].any()


@pytest.mark.parametrize("noise", [0.0, 0.2, 1.0])
@pytest.mark.parametrize("step", [0.0, 1.0 / 64.0, 2.0, 20.0])
def test_nothing_is_told_of_clean_recordings(noise: float, step: float) -> None:
    """Noise-free simulations, fine and coarse converters, at rest and in motion."""
    faults = examined(make_raw(7, noise=noise, step=step))[0]
    # Steps of ten times the described noise are one, whatever the simulation's own noise is
    assert {fault.where.get("law") for fault in faults} == ({"steps"} if step == 20.0 else set())


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_slack_cable_and_an_idle_exciter_read_zero(noise: float) -> None:
    raw = changed(make_raw(noise=noise), "cable_1", lambda v: np.maximum(v - 4200.0, 0.0))
    time = np.arange(round(12.0 * RATE)) / RATE
    force = np.where(
        (time % 4.0 < 2.0)[:, None], 80.0 * np.sin(2.0 * np.pi * time)[:, None] * np.ones(3), 0.0
    )
    run = raw.recordings[1]
    run = dataclasses.replace(run, channels=(*run.channels, channel("exciter_force", "exciter", force)))
    assert examined(dataclasses.replace(raw, recordings=(raw.recordings[0], run)))[0] == []


@pytest.mark.parametrize("noise", [0.0, 0.5])
def test_a_force_that_switches_is_neither_wrapped_nor_held_nor_filled(noise: float) -> None:
    raw = make_raw()
    time = np.arange(round(12.0 * RATE)) / RATE
    for low in (-80.0, 0.0):
        force = np.where(np.sin(2.0 * np.pi * 0.8 * time) > 0.0, 80.0, low)[:, None] * np.array(
            [1.0, 0.3, 0.1]
        )
        force = force + noise * np.random.default_rng(1).normal(size=force.shape)
        run = raw.recordings[1]
        run = dataclasses.replace(run, channels=(*run.channels, channel("exciter_force", "exciter", force)))
        assert examined(dataclasses.replace(raw, recordings=(raw.recordings[0], run)))[0] == []


def test_a_filter_of_the_sensor_is_no_average() -> None:
    def filtered(values: np.ndarray) -> np.ndarray:
        out = np.array(values)
        for k in range(1, len(out)):
            out[k] = out[k - 1] + 0.1 * (values[k] - out[k - 1])
        return np.round(out * 64.0) / 64.0

    assert examined(changed(make_raw(), "cable_2", filtered))[0] == []


@pytest.mark.skipif(not SESSIONS, reason=f"no sessions in {RECORDINGS}: set RIG_IDENTIFICATION_RECORDINGS")
@pytest.mark.parametrize("folder", SESSIONS, ids=lambda folder: folder.name)
def test_nothing_but_what_is_there_is_told_of_recordings_of_rigs(folder: Path) -> None:
    told = [fault.effect for fault in examined(read_raw(folder))[0]]
    # The film of this one was read at half of its pictures' rate
    known = {"ucd_selftest": ["held_samples"], "mathworks_demo": ["cycling_samples"]}
    assert told == known.get(folder.name, [])


@pytest.mark.parametrize("seed", range(3))
def test_coarse_steps_are_told_and_their_passages_kept(seed: int) -> None:
    exact = make_raw(seed, noise=0.0, step=0.0)
    rounded = make_raw(seed, step=12.0 * NOISE)
    found = coarse_steps.find(rounded)
    told = {f.fault.where["channel"] for f in found}
    assert told >= {*CELLS}
    assert all(f.fault.where["law"] == "steps" for f in found)
    step = {f.fault.where["channel"]: f.fault.parameters["step"]["value"] for f in found}
    assert step["cable_1"] == pytest.approx(12.0 * NOISE)
    for number, recording in enumerate(exact.recordings):
        for kept, true in zip(found[-1].session.recordings[number].channels, recording.channels, strict=True):
            if true.channel == "tension":
                off = (kept.values - true.values)[np.isfinite(kept.values)]
                # Each passage is read to within the noise, where the rounded samples are off by 3.5 of it
                assert off.size == 0 or np.sqrt(np.mean(off**2)) < 1.2 * NOISE
                assert recording.kind == "static" or off.size > 50


def test_coarse_steps_of_two_axes_of_one_channel_are_each_kept_half_way() -> None:
    """What one axis keeps is not undone by what the other one does."""
    raw = make_raw(step=200.0 * NOISE)
    found = [f for f in coarse_steps.find(raw) if f.fault.where["channel"] == "imu"]
    assert len({f.fault.where["axis"] for f in found}) > 1
    for f in found:
        column = "xyz".index(f.fault.where["axis"]) + 3 * (f.fault.where["quantity"] == "specific_force")
        step = f.fault.parameters["step"]["value"]
        for recording in found[-1].session.recordings:
            (imu,) = (c.values[:, column] for c in recording.channels if c.device == "imu")
            apart = np.abs(imu[np.isfinite(imu)] / step % 1.0 - 0.5)
            assert np.all(apart < 0.25)


@pytest.mark.parametrize("step", [0.0, 1.0, 2.0, 3.0])
def test_steps_that_noise_spreads_over_are_no_fault(step: float) -> None:
    assert coarse_steps.find(make_raw(step=step * NOISE)) == ()


def test_numbers_that_no_device_measures_are_not_computed_with() -> None:
    """Damaged bytes read as a number: the message counts as one in which nothing was measured."""

    def damaged(values: np.ndarray) -> np.ndarray:
        values[100:103, 0] = 1e308, -np.inf, 2e12
        return values

    def unmeasured(values: np.ndarray) -> np.ndarray:
        values[100:103] = np.nan
        return values

    raw = make_raw(seconds=1.5)
    found, expected = (examine(changed(raw, "imu", change)) for change in (damaged, unmeasured))
    assert found.examination.faults == expected.examination.faults
    for one, other in zip(found.session.recordings, expected.session.recordings, strict=True):
        ours, theirs = one.channel("imu"), other.channel("imu")
        assert ours is not None
        assert theirs is not None
        assert np.array_equal(ours.values, theirs.values, equal_nan=True)
