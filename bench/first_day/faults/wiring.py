"""Right readings in the wrong place: swapped plugs, summed cells, an IMU under another mount."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from bench.first_day.faults.base import Array, Case, Injector, cells, devices, on_values, picked, times
from rig_identification.raw import RawChannel, RawRecording, RawSession
from rig_identification.rig import Mount


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of wiring that the session can have."""
    if len(cells(raw)) > 1:
        yield from _cells(raw)
    if raw.rig.imu is not None and "imu" in devices(raw):
        yield from _imu_mounts(raw)


def _cells(raw: RawSession) -> Iterator[Case]:
    names = cells(raw)
    for first, second in [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]:
        yield Case(
            f"wiring/swapped/{first}_{second}",
            "wiring",
            (first, second),
            _relabelled({first: second, second: first}),
        )
    if len(names) > 2:
        turn = dict(zip(names[:3], (*names[1:3], names[0]), strict=True))
        yield Case("wiring/swapped/three_in_turn", "wiring", names[:3], _relabelled(turn))
        turn = dict(zip(names, (*names[1:], names[0]), strict=True))
        if len(names) > 3:
            yield Case("wiring/swapped/all_in_turn", "wiring", names, _relabelled(turn))
    one = picked(raw, 3)
    other = next(n for n in names[::-1] if n != one)
    yield Case(f"wiring/doubled/{one}_shows_{other}", "wiring", (one, other), _doubled(one, other))
    for label, chosen in ((one, (one,)), ("all_cells", names)):
        yield Case(f"wiring/negative/{label}", "wiring", chosen, on_values(chosen, times(-1.0)))
    yield Case("wiring/summing_box/every_cell_shows_the_sum", "wiring", names, _summed(1.0))
    yield Case("wiring/summing_box/every_cell_shows_the_mean", "wiring", names, _summed(1.0 / len(names)))
    yield Case("wiring/summing_box/one_cell_shows_the_sum", "wiring", names, _summed_into_first)


def _relabelled(shows: dict[str, str]) -> Injector:
    """Each cable of ``shows`` gets the messages of the one that it maps to."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        recordings = []
        for recording in raw.recordings:
            held = {c.cable: c for c in recording.channels if c.cable is not None}
            new = [
                replace(held[source], topic=held[name].topic, cable=name)
                for name, source in shows.items()
                if name in held and source in held
            ]
            recordings.append(recording.with_channels(*new))
        return replace(raw, recordings=tuple(recordings))

    return inject


def _doubled(name: str, source: str) -> Injector:
    """Channel ``name`` shows what ``source`` measures, at stamps of its own: one amplifier read twice."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        recordings = []
        for recording in raw.recordings:
            shown, read = recording.channel(name), recording.channel(source)
            if shown is not None and read is not None:
                latest = np.searchsorted(read.stamp_ns, shown.stamp_ns, side="right") - 1
                recording = recording.with_channels(replace(shown, values=read.values[np.maximum(latest, 0)]))
            recordings.append(recording)
        return replace(raw, recordings=tuple(recordings))

    return inject


def _sum_at(recording: RawRecording, stamps: np.ndarray) -> Array:
    total = np.zeros(len(stamps))
    for channel in recording.channels:
        if channel.cable is not None:
            total += np.interp(stamps, channel.stamp_ns, channel.values[:, 0])
    return total


def _summed(share: float) -> Injector:
    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        recordings = []
        for recording in raw.recordings:
            new = [
                replace(c, values=share * _sum_at(recording, c.stamp_ns)[:, None])
                for c in recording.channels
                if c.cable is not None
            ]
            recordings.append(recording.with_channels(*new))
        return replace(raw, recordings=tuple(recordings))

    return inject


def _summed_into_first(raw: RawSession, rng: np.random.Generator) -> RawSession:
    """All cells on one amplifier: one channel has the sum, the others are not recorded."""
    first = cells(raw)[0]
    recordings = []
    for recording in raw.recordings:
        channels: list[RawChannel] = []
        for c in recording.channels:
            if c.cable == first:
                channels.append(replace(c, values=_sum_at(recording, c.stamp_ns)[:, None]))
            elif c.cable is None:
                channels.append(c)
        topics = {c.topic for c in channels}
        recordings.append(
            replace(
                recording,
                channels=tuple(channels),
                listed={t: k for t, k in recording.listed.items() if t in topics},
                counts={t: n for t, n in recording.counts.items() if t in topics},
            )
        )
    return replace(raw, recordings=tuple(recordings))


def _imu_mounts(raw: RawSession) -> Iterator[Case]:
    imu = raw.rig.imu
    assert imu is not None
    others = {"exciter": raw.rig.exciter, "inclinometer": raw.rig.inclinometer, "mocap": raw.rig.mocap}
    for name, mount in others.items():
        if mount is None:
            continue
        turn = Rotation.from_quat(imu.orientation).inv() * Rotation.from_quat(mount.orientation)
        permuted = _near_permutation(turn.as_matrix())
        # An inclinometer's position is not described: only the orientation is taken from it
        place = imu.position if name == "inclinometer" else mount.position
        same = turn.magnitude() < 0.01 and float(np.linalg.norm(place - imu.position)) < 0.01
        if not same:
            yield Case(
                f"wiring/imu_mount/of_{name}",
                "wiring",
                ("imu",),
                _mounted(Mount(place, mount.orientation)),
                also=("axes", "imu_position", "imu_misalignment") if permuted else ("imu_misalignment",),
                untellable=""
                if turn.magnitude() > 0.01
                else "with the orientation right only the lever arm is wrong: imu_position of the fit",
            )


def _near_permutation(matrix: Array) -> bool:
    return bool(np.max(np.abs(matrix - np.round(matrix))) < 0.01)


def _mounted(mount: Mount) -> Injector:
    return lambda raw, rng: replace(raw, rig=replace(raw.rig, imu=mount))
