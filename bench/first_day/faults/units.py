"""Readings and descriptions in other units than SI: what amplifiers, drivers and tape measures speak."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from bench.first_day.faults.base import (
    IMU_FORCE,
    IMU_RATE,
    Array,
    Case,
    Injector,
    cells,
    devices,
    on_values,
    one_and_all,
    picked,
    times,
)
from rig_identification.raw import RawChannel, RawSession
from rig_identification.rig import Mount, Rig

G0 = 9.80665
POUND_FORCE, INCH = 4.4482216152605, 0.0254
#: Readings per newton.
FORCE_UNITS = {"kgf": 1 / G0, "gf": 1000 / G0, "lbf": 1 / POUND_FORCE, "kN": 1e-3, "mN": 1e3}
#: Readings per metre.
LENGTH_UNITS = {"mm": 1e3, "cm": 1e2, "inch": 1 / INCH}
DEGREES = 180.0 / np.pi
#: Counts per newton of an amplifier read without scale, by strength, as a share of full scale at rest.
COUNTS = {"12_bit": 2**11, "16_bit": 2**15, "24_bit": 2**23}


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of units that the session's devices and description can have."""
    yield from _tensions(raw)
    yield from _counts(raw)
    held = devices(raw)
    if "exciter" in held:
        for unit, factor in FORCE_UNITS.items():
            yield _scaled("exciter", ("exciter",), unit, factor)
    if "imu" in held:
        yield from _imu()
    if "inclinometer" in held:
        yield _scaled("inclinometer", ("inclinometer",), "degrees", DEGREES)
    if "mocap" in held:
        for unit, factor in LENGTH_UNITS.items():
            inject = on_values(("mocap",), times(factor), slice(0, 3))
            yield Case(f"unit/mocap/{unit}", "unit", ("mocap",), inject, expected={"factor": factor})
    yield from _descriptions(raw)


def _scaled(label: str, names: tuple[str, ...], unit: str, factor: float) -> Case:
    return Case(
        f"unit/{label}/{unit}", "unit", names, on_values(names, times(factor)), expected={"factor": factor}
    )


def _tensions(raw: RawSession) -> Iterator[Case]:
    for salt, (unit, factor) in enumerate(FORCE_UNITS.items()):
        for label, names in one_and_all(raw, salt):
            yield _scaled(label, names, unit, factor)
    yield Case(
        "unit/all_cells/kgf_nothing_weighed",
        "unit",
        cells(raw),
        _nothing_weighed,
        untellable="with neither mass, dummy nor exciter's force every force scales with the unknown mass",
    )


def _nothing_weighed(raw: RawSession, rng: np.random.Generator) -> RawSession:
    """No scale, no dummy, no exciter: the motion knows ratios of forces to the mass alone."""
    raw = on_values(cells(raw), times(1.0 / G0))(raw, rng)
    rig = replace(raw.rig, mass=None, mass_std=None, frame=None, exciter=None)
    recordings = tuple(
        replace(r, channels=tuple(c for c in r.channels if c.device != "exciter"))
        for r in raw.recordings
        if r.dummy is None
    )
    return replace(raw, rig=rig, recordings=recordings)


def _counts(raw: RawSession) -> Iterator[Case]:
    """Counts of an amplifier: integers, each cell with a span of its own, the tare not taken off."""
    for salt, (label, full) in enumerate(COUNTS.items()):
        for place, names in one_and_all(raw, salt):
            yield Case(f"unit/{place}/counts_{label}", "unit", names, _as_counts(names, full))


def _as_counts(names: tuple[str, ...], full: int) -> Injector:
    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        for name in names:
            # A third of full scale at rest; spans of cells of one make differ by percents, zeros by more
            rest = max(float(np.mean(np.abs(_any(raw, name).values))), 1e-9)
            per_newton = full / 3.0 / rest * rng.uniform(0.95, 1.05)
            zero = full * rng.uniform(-0.1, 0.1)
            raw = on_values((name,), _counted(per_newton, zero))(raw, rng)
        return raw

    return inject


def _counted(per_newton: float, zero: float) -> Callable[[Array], Array]:
    return lambda values: np.round(per_newton * values + zero)


def _any(raw: RawSession, name: str) -> RawChannel:
    return next(c for r in raw.recordings for c in r.channels if c.device == name)


def _imu() -> Iterator[Case]:
    force = {"g": 1.0 / G0, "milli_g": 1000.0 / G0}
    for unit, factor in force.items():
        inject = on_values(("imu",), times(factor), IMU_FORCE)
        yield Case(f"unit/imu/{unit}", "unit", ("imu",), inject, expected={"factor": factor})
    rate = on_values(("imu",), times(DEGREES), IMU_RATE)
    yield Case("unit/imu/degrees_per_second", "unit", ("imu",), rate, expected={"factor": DEGREES})

    def both(raw: RawSession, rng: np.random.Generator) -> RawSession:
        raw = on_values(("imu",), times(1.0 / G0), IMU_FORCE)(raw, rng)
        return on_values(("imu",), times(DEGREES), IMU_RATE)(raw, rng)

    yield Case("unit/imu/g_and_degrees_per_second", "unit", ("imu",), both)


def _descriptions(raw: RawSession) -> Iterator[Case]:
    """Lengths of rig.yaml and session.yaml in what the tape measure shows."""
    one = picked(raw, 7)
    with_imu = raw.rig.imu is not None and "imu" in devices(raw)
    with_dummy = any(r.dummy is not None for r in raw.recordings)
    for unit, factor in LENGTH_UNITS.items():
        rig = _resized_rig(raw.rig, factor)
        yield Case(f"unit/rig_lengths/{unit}", "unit", (), _described(rig))
        rig = _longer(raw.rig, one, factor)
        yield Case(f"unit/length_of_{one}/{unit}", "unit", (one,), _described(rig), also=("cable_length",))
        if with_imu:
            rig = _imu_at(raw.rig, factor)
            yield Case(f"unit/imu_position/{unit}", "unit", ("imu",), _described(rig), also=("imu_position",))
        if with_dummy:
            yield Case(f"unit/dummy_position/{unit}", "unit", (), _dummy_at(factor), also=("dummy_error",))


def _described(rig: Rig) -> Injector:
    return lambda raw, rng: replace(raw, rig=rig)


def _resized_rig(rig: Rig, factor: float) -> Rig:
    """Every length of the rig description times ``factor``; masses and angles stay."""
    cables = tuple(
        replace(
            c,
            ceiling_point=factor * c.ceiling_point,
            body_point=factor * c.body_point,
            length=factor * c.length,
        )
        for c in rig.cables
    )
    frame = rig.frame
    if frame is not None:
        frame = replace(frame, center_of_mass=factor * frame.center_of_mass)
    return replace(
        rig,
        cables=cables,
        frame=frame,
        imu=_farther(rig.imu, factor),
        exciter=_farther(rig.exciter, factor),
        mocap=_farther(rig.mocap, factor),
    )


def _farther(mount: Mount | None, factor: float) -> Mount | None:
    return None if mount is None else replace(mount, position=factor * mount.position)


def _longer(rig: Rig, name: str, factor: float) -> Rig:
    cables = tuple(replace(c, length=factor * c.length) if c.name == name else c for c in rig.cables)
    return replace(rig, cables=cables)


def _imu_at(rig: Rig, factor: float) -> Rig:
    return replace(rig, imu=_farther(rig.imu, factor))


def _dummy_at(factor: float) -> Injector:
    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        recordings = tuple(
            r if r.dummy is None else replace(r, dummy=replace(r.dummy, position=factor * r.dummy.position))
            for r in raw.recordings
        )
        return replace(raw, recordings=recordings)

    return inject
