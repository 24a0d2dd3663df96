"""Readings that err in a cycle: found, averaged away; and what only looks alike is left."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from test_check_readings import changed, channel, make_raw, swing

from rig_identification.check.readings.cycling_samples import find
from rig_identification.raw import RawRecording, RawSession

SECONDS = 60.0


def slow(rate: float, err: np.ndarray, noise: float) -> RawSession:
    """Two runs of a gyroscope at ``rate`` whose samples err by ``err`` in turn."""
    raw = make_raw()
    runs = []
    for seed, name in enumerate(("run_1", "run_2")):
        count = round(SECONDS * rate)
        values = 0.3 * swing(SECONDS, rate, 0.2, seed)[:, None] * [1.0, 0.5, 0.2, 0.0, 0.0, 0.0]
        turn = np.arange(count) % err.size
        values += err[turn][:, None] + noise * np.random.default_rng(seed).normal(size=values.shape)
        runs.append(RawRecording(name, "dynamic", False, name, (channel("imu", "imu", values, rate),)))
    return dataclasses.replace(raw, recordings=tuple(runs))


CYCLE = np.array([0.013, -0.004, -0.0025, -0.0025, -0.004])


@pytest.mark.parametrize(
    "err", [CYCLE, np.array([0.01, -0.01]), np.array([0.02, 0.0, 0.0, -0.01, 0.0, 0.0, 0.0])]
)
def test_a_cycle_is_averaged_away(err: np.ndarray) -> None:
    (found,) = find(slow(20.0, err, 1e-3))
    assert found.fault.effect == "cycling_samples"
    assert found.fault.parameters["samples"]["value"] == err.size
    left = found.session.recordings[0].channels[0]
    time = (left.stamp_ns - slow(20.0, err, 1e-3).recordings[0].channels[0].stamp_ns[0]) / 1e9
    angle = 2.0 * np.pi * 0.2 * time
    truth = 0.3 * (np.sin(angle) + 0.1 * np.cos(2.0 * angle))
    error = left.values[1:-1, 0] - truth[1:-1]
    assert np.std(error) < 1.5e-3 / np.sqrt(err.size)


def test_noise_a_tone_and_what_is_small_are_no_cycle() -> None:
    assert find(slow(20.0, np.zeros(5), 1e-3)) == ()
    assert find(slow(20.0, 0.01 * np.cos(2.0 * np.pi * np.arange(5) / 5), 1e-3)) == ()
    assert find(slow(20.0, 0.02 * CYCLE, 1e-3)) == ()


def test_what_one_recording_shows_and_the_other_does_not_is_no_cycle() -> None:
    both, none = slow(20.0, CYCLE, 1e-3), slow(20.0, np.zeros(5), 1e-3)
    mixed = dataclasses.replace(both, recordings=(both.recordings[0], none.recordings[1]))
    assert find(mixed) == ()


def test_a_lost_sample_shifts_no_cycle() -> None:
    raw = slow(20.0, CYCLE, 1e-3)

    def less(recording: RawRecording) -> RawRecording:
        one = recording.channels[0]
        kept = np.ones(one.stamp_ns.size, bool)
        kept[[100, 333, 334]] = False
        return recording.with_channels(
            dataclasses.replace(
                one, stamp_ns=one.stamp_ns[kept], received_ns=one.received_ns[kept], values=one.values[kept]
            )
        )

    lost = dataclasses.replace(raw, recordings=tuple(less(r) for r in raw.recordings))
    (found,) = find(lost)
    assert found.fault.parameters["samples"]["value"] == 5
    assert found.session.recordings[0].channels[0].stamp_ns.size == pytest.approx(SECONDS * 4 - 2)


def test_no_cycle_in_ordinary_sessions() -> None:
    assert find(make_raw()) == ()
    assert find(changed(make_raw(2), "cable_1", lambda v: v + 0.0)) == ()
