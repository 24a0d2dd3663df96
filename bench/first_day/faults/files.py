"""Files and weights that are not as session.yaml and rig.yaml say: swapped bags, dummy and scale."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bench.first_day.faults.base import Array, Case, Injector
from rig_identification.raw import RawRecording, RawSession

POUND = 0.45359237  # kg
#: Shares by which a dummy's mass is off, and distances by which its place is, in spans of the body.
MASS_OFF, PLACE_OFF = (0.05, 0.15, 0.5), (0.05, 0.15, 0.5)


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of files and weights that the session can have."""
    yield from _files(raw)
    yield from _dummies(raw)
    if raw.rig.mass is not None:
        for name, factor in (("pounds", 1.0 / POUND), ("read_as_pounds", POUND)):
            true = {"mass": raw.rig.mass}
            yield Case(f"wiring/mass/{name}", "mass_error", (), _weighed(factor), expected=true)


def _files(raw: RawSession) -> Iterator[Case]:
    runs = [k for k, r in enumerate(raw.recordings) if r.kind == "dynamic"]
    if len(runs) == 2:
        yield Case(
            "wiring/files/runs_swapped",
            "wiring",
            (),
            _swapped_files(*runs),
            untellable="two good runs exchanged are two good runs: a warning tells their dates",
        )
        yield Case(
            "wiring/files/runs_swapped_no_dates",
            "wiring",
            (),
            _undated(runs),
            untellable="two good runs under each other's names, without dates, are two good runs",
        )
        yield Case("wiring/files/same_run_twice", "wiring", (), _copied(runs[0], runs[1]))
    statics = [k for k, r in enumerate(raw.recordings) if r.kind == "static"]
    if len(statics) == 2:
        yield Case("wiring/files/bare_and_dummy_swapped", "wiring", (), _swapped_files(*statics))
        yield Case("wiring/files/bare_given_as_dummy", "wiring", (), _copied(statics[0], statics[1]))


def _contents(recording: RawRecording, other: RawRecording) -> RawRecording:
    """``recording`` with the messages of ``other``."""
    return replace(recording, channels=other.channels, listed=other.listed, counts=other.counts)


def _swapped_files(first: int, second: int) -> Injector:
    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        r = list(raw.recordings)
        r[first], r[second] = _contents(r[first], r[second]), _contents(r[second], r[first])
        return replace(raw, recordings=tuple(r))

    return inject


def _copied(source: int, target: int) -> Injector:
    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        r = list(raw.recordings)
        r[target] = _contents(r[target], r[source])
        return replace(raw, recordings=tuple(r))

    return inject


def _undated(runs: list[int]) -> Injector:
    """The two runs swapped, on stamps that both begin at the same instant."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        raw = _swapped_files(*runs)(raw, rng)
        r = list(raw.recordings)
        begin = min(int(c.stamp_ns[0]) for c in raw.recordings[runs[0]].channels)
        for k in runs:
            late = min(int(c.stamp_ns[0]) for c in r[k].channels) - begin
            earlier = [
                replace(c, stamp_ns=c.stamp_ns - late, received_ns=c.received_ns - late)
                for c in r[k].channels
            ]
            r[k] = r[k].with_channels(*earlier)
        return replace(raw, recordings=tuple(r))

    return inject


def _dummies(raw: RawSession) -> Iterator[Case]:
    if not any(r.dummy is not None for r in raw.recordings):
        return
    dummy = next(r.dummy for r in raw.recordings if r.dummy is not None)
    true = {"mass": dummy.mass}
    span = np.ptp([c.body_point for c in raw.rig.cables], axis=0)[:2]
    for share in MASS_OFF:
        name = f"wiring/dummy_mass/{100 * share:.0f}_percent_more"
        yield Case(name, "dummy_error", (), _dummy(1.0 + share, 0.0), expected=true)
    yield Case("wiring/dummy_mass/pounds", "dummy_error", (), _dummy(1.0 / POUND, 0.0), also=("unit",))
    for share in PLACE_OFF:
        away = share * np.array([span[0], -span[1], 0.0])
        name = f"wiring/dummy_place/{100 * share:.0f}_percent_of_span"
        yield Case(name, "dummy_error", (), _dummy(1.0, away))
    if abs(dummy.position[0] - dummy.position[1]) > PLACE_OFF[0] * float(np.max(span)):
        yield Case("wiring/dummy_place/x_y_swapped", "dummy_error", (), _dummy_turned)


def _dummy(factor: float, away: Array | float) -> Injector:
    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        recordings = tuple(
            r
            if r.dummy is None
            else replace(
                r, dummy=replace(r.dummy, mass=factor * r.dummy.mass, position=r.dummy.position + away)
            )
            for r in raw.recordings
        )
        return replace(raw, recordings=recordings)

    return inject


def _dummy_turned(raw: RawSession, rng: np.random.Generator) -> RawSession:
    recordings = tuple(
        r if r.dummy is None else replace(r, dummy=replace(r.dummy, position=r.dummy.position[[1, 0, 2]]))
        for r in raw.recordings
    )
    return replace(raw, recordings=recordings)


def _weighed(factor: float) -> Injector:
    """The scale's reading in another unit; the frame was weighed on the same scale."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        assert raw.rig.mass is not None
        return replace(raw, rig=replace(raw.rig, mass=factor * raw.rig.mass))

    return inject
