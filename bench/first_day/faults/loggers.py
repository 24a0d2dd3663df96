"""Faults of loggers and links: frozen, lost, spoilt, held and averaged samples.

As reported in public: an HX711 hands over 2^n - 1 or doubled values in 1 to 5 % of reads (bogde/HX711 issues
83 and 216, tatobari/hx711py issue 7). Behind it loggers repeat the last value, fill with zeros, send means.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bench.first_day.faults.base import (
    IMU_RATE,
    Case,
    ChannelChange,
    cells,
    devices,
    on,
    one_and_all,
    picked,
)
from rig_identification.raw import RawChannel, RawSession

FROZEN = (0.2, 0.6, 1.0)  # share of each recording
LOST = (0.005, 0.05, 0.2)  # share of samples
SPIKES = (0.001, 0.01, 0.05)  # share of samples
HELD = {"cell": (5, 20, 50), "imu": (2, 5, 10), "inclinometer": (2, 5), "mocap": (2, 5, 10)}  # samples
WINDOWS = (0.05, 0.2, 0.5)  # s
RATE_RANGE, FORCE_RANGE = np.deg2rad(250.0), 2 * 9.80665  # full scale of an IMU: rad/s, m/s^2

Places = list[tuple[str, tuple[str, ...]]]


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of loggers and links that the session's devices can have."""
    held = devices(raw)
    others: Places = [(d, (d,)) for d in ("imu", "mocap") if d in held]
    slow: Places = [(d, (d,)) for d in ("imu", "inclinometer", "mocap") if d in held]
    for k in range(3):
        both: Places = one_and_all(raw, k) if cells(raw) else []
        one: Places = [(d, (d,)) for d in ((picked(raw, k),) if cells(raw) else ())]
        for label, names in (*one, *slow):
            name = f"cells/frozen/{label}/last_{100 * FROZEN[k]:.0f}_percent"
            yield Case(name, "frozen_channel", names, on(names, _frozen(FROZEN[k])))
        for label, names in (*both, *others):
            name = f"cells/zero_filled/{label}/{100 * LOST[k]:g}_percent"
            yield Case(name, "zero_filled", names, on(names, _zeros(LOST[k])))
            name = f"cells/spikes/{label}/{100 * SPIKES[k]:g}_percent"
            yield Case(name, "spikes", names, on(names, _spiked(SPIKES[k])))
            name = f"cells/averaged/{label}/{1000 * WINDOWS[k]:.0f}_ms"
            yield _averaging(name, names, WINDOWS[k])
        for label, names in (*both, *slow):
            lengths = HELD[label if label in HELD else "cell"]
            if k < len(lengths):
                name = f"cells/held/{label}/{lengths[k]}_samples"
                yield Case(name, "held_samples", names, on(names, _held(lengths[k])))


def _averaging(name: str, names: tuple[str, ...], window: float) -> Case:
    return Case(
        name,
        "averaged_samples",
        names,
        on(names, _averaged(window)),
        also=("sensor_lag",),
        expected={"delay": 0.5 * window},
        within=0.2,
    )


def _frozen(share: float) -> ChannelChange:
    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        last = round((1.0 - share) * (len(channel.values) - 1))
        values = channel.values.copy()
        values[last:] = values[last]
        return replace(channel, values=values)

    return change


def _zeros(share: float) -> ChannelChange:
    """Packets of some ten samples that were lost and filled with zeros."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        count = len(channel.values)
        # One packet at least, or a short recording would have no fault
        packets = max(1, round(share * count / 12.0))
        values = channel.values.copy()
        for begin in rng.integers(0, max(count - 20, 1), packets):
            values[begin : begin + int(rng.integers(5, 20))] = 0.0
        return replace(channel, values=values)

    return change


def _spiked(share: float) -> ChannelChange:
    """Single reads gone wrong: doubled by a clock edge too many, halved, at full scale, a bit flipped."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        count, width = channel.values.shape
        hit = rng.choice(count, max(2, round(share * count)), replace=False)
        values = channel.values.copy()
        if channel.channel == "mocap":
            # Markers taken for each other: the body jumps by centimetres and turns
            values[hit, :3] += rng.normal(0.0, 0.2, (len(hit), 3))
            return replace(channel, values=values)
        column = rng.integers(0, width, len(hit))
        read = channel.values[hit, column]
        if channel.channel == "imu":
            # Twice a rate of next to nothing is nothing: a flipped high bit is a share of full scale
            full = np.where(column < IMU_RATE.stop, RATE_RANGE, FORCE_RANGE)
            wrong = np.stack([full, -full, read + 0.5 * full, read - 0.5 * full])
        else:
            full = np.max(np.abs(channel.values), axis=0)[column]
            wrong = np.stack([2.0 * read, 0.5 * read, 8.0 * full, -read - full])
        values[hit, column] = wrong[rng.integers(0, 4, len(hit)), np.arange(len(hit))]
        return replace(channel, values=values)

    return change


def _held(samples: int) -> ChannelChange:
    """The device is slower than its messages: each value is sent ``samples`` times."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        first = int(rng.integers(0, samples))
        at = np.maximum((np.arange(len(channel.values)) - first) // samples * samples + first, 0)
        return replace(channel, values=channel.values[at])

    return change


def _averaged(window: float) -> ChannelChange:
    """Each message holds the mean of the last ``window`` seconds: late by half of it."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        interval = float(np.median(np.diff(channel.stamp_ns))) / 1e9
        width = max(2, round(window / interval))
        padded = np.concatenate([np.repeat(channel.values[:1], width - 1, axis=0), channel.values])
        sums = np.cumsum(np.concatenate([np.zeros((1, padded.shape[1])), padded]), axis=0)
        values = (sums[width:] - sums[:-width]) / width
        if channel.channel == "mocap":
            values[:, 3:7] /= np.linalg.norm(values[:, 3:7], axis=1, keepdims=True)
        return replace(channel, values=values)

    return change
