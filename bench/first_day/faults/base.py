"""One fault put into one session: what it does to the raw messages, and what a right answer says of it."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.raw import RawChannel, RawSession

Array = NDArray[np.float64]
Injector = Callable[[RawSession, np.random.Generator], RawSession]
ChannelChange = Callable[[RawChannel, np.random.Generator], RawChannel]

IMU_RATE, IMU_FORCE = slice(0, 3), slice(3, 6)


@dataclass(frozen=True)
class Case:
    """A fault of one kind, place and strength."""

    name: str  # "unit/tension/kgf/cable_2"
    effect: str  # the word of the effects' table that a right answer gives
    channels: tuple[str, ...]  # contract words that a right answer may give; empty: the fault has no channel
    inject: Injector
    kinds: tuple[str, ...] = ()  # of a stamp error: words that a right answer may give of it
    also: tuple[str, ...] = ()  # effect words that are as true
    untellable: str = ""  # the physical reason why no recording of this session shows it; "": it shows
    expected: dict[str, float] = field(default_factory=dict)  # parameters that a right answer gives
    within: float = 0.01  # relative, of those parameters

    @property
    def group(self) -> str:
        """First part of the name."""
        return self.name.partition("/")[0]

    def session(self, raw: RawSession, seed: int) -> RawSession:
        """The session with the fault in it; the same seed draws the same fault."""
        rng = np.random.default_rng([seed, zlib.crc32(self.name.encode())])
        return self.inject(raw, rng)


def devices(raw: RawSession) -> tuple[str, ...]:
    """Devices of the session that an estimate may use, cables first."""
    cables = [cable.name for cable in raw.rig.cables]
    held = {c.device for r in raw.recordings for c in r.channels}
    return tuple(d for d in (*cables, "imu", "inclinometer", "mocap", "exciter") if d in held)


def cells(raw: RawSession) -> tuple[str, ...]:
    """Cables whose tension is recorded."""
    held = devices(raw)
    return tuple(cable.name for cable in raw.rig.cables if cable.name in held)


def picked(raw: RawSession, salt: int = 0) -> str:
    """One cell, another for another session or ``salt``."""
    names = cells(raw)
    return names[(zlib.crc32(raw.name.encode()) + salt) % len(names)]


def changed(
    raw: RawSession,
    names: Iterable[str],
    change: ChannelChange,
    rng: np.random.Generator,
    kinds: tuple[str, ...] = ("static", "dynamic"),
) -> RawSession:
    """The session with ``change`` applied to every channel of the devices ``names``."""
    chosen = frozenset(names)
    recordings = []
    for recording in raw.recordings:
        if recording.kind in kinds:
            new = [change(c, rng) for c in recording.channels if c.device in chosen]
            recording = recording.with_channels(*new)
        recordings.append(recording)
    return replace(raw, recordings=tuple(recordings))


def on(
    names: Iterable[str], change: ChannelChange, kinds: tuple[str, ...] = ("static", "dynamic")
) -> Injector:
    """Injector that applies ``change`` to the devices ``names``."""
    chosen = tuple(names)
    return lambda raw, rng: changed(raw, chosen, change, rng, kinds)


def on_values(
    names: Iterable[str],
    law: Callable[[Array], Array],
    columns: slice = slice(None),
    kinds: tuple[str, ...] = ("static", "dynamic"),
) -> Injector:
    """Injector that maps some columns (n, k) of the devices' values by ``law``."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        values = channel.values.copy()
        values[:, columns] = law(values[:, columns])
        return replace(channel, values=values)

    return on(names, change, kinds)


def times(factor: float) -> Callable[[Array], Array]:
    """The law of a wrong scale."""
    return lambda values: np.asarray(factor * values)


def through(matrix: Array) -> Callable[[Array], Array]:
    """The law of vectors (n, k) in turned or mirrored axes."""
    return lambda values: np.asarray(values @ matrix.T)


def resting_mean(raw: RawSession, device: str, kind_with_dummy: bool = False) -> Array:
    """(width,) mean reading at rest, with or without the dummy."""
    for recording in raw.recordings:
        if recording.kind == "static" and (recording.dummy is not None) == kind_with_dummy:
            channel = recording.channel(device)
            if channel is not None:
                return np.asarray(np.mean(channel.values, axis=0))
    raise ValueError(f"{raw.name}: {device} has no recording at rest, dummy {kind_with_dummy}")


def moving(raw: RawSession, device: str) -> Array:
    """(n, width) readings of a device over all dynamic recordings."""
    found = [r.channel(device) for r in raw.recordings if r.kind == "dynamic"]
    return np.concatenate([c.values for c in found if c is not None])


def one_and_all(raw: RawSession, salt: int = 0) -> list[tuple[str, tuple[str, ...]]]:
    """Label and names of one cell, and of all cells."""
    one = picked(raw, salt)
    return [(one, (one,)), ("all_cells", cells(raw))]
