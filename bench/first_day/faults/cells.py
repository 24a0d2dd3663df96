"""Faults of amplifiers and converters: tare under load, gains, ends of range, counters that wrap.

An HX711's counts are 24 bits in two's complement, whose sign drivers have lost (olkal/HX711_ADC issue 40);
its channels have gains of 128, 64 and 32.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from bench.first_day.faults.base import (
    IMU_FORCE,
    IMU_RATE,
    Array,
    Case,
    Injector,
    cells,
    devices,
    moving,
    on_values,
    one_and_all,
    picked,
    resting_mean,
    times,
)
from rig_identification.raw import RawSession

Law = Callable[[Array], Array]
LawOf = Callable[[RawSession, str], Law]  # set by what the device itself reads

GAINS = (0.01, 0.03, 0.1)
BEYOND = (0.02, 0.2, 0.6)  # share of moving samples beyond the range
COARSE = (6.0, 20.0)  # steps of a converter, in units of the noise
RATE_RANGE = np.deg2rad(250.0)  # rad/s, full scale of a gyroscope


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of amplifiers and converters that the session's devices can have."""
    held = devices(raw)
    if cells(raw):
        yield from _zeroed(raw)
        yield from _gains(raw)
    yield from _ranges(raw, held)
    yield from _steps(raw, held)


def _steps(raw: RawSession, held: tuple[str, ...]) -> Iterator[Case]:
    """Converters whose steps noise does not spread over: a law that the table has no word for.

    Only where the description tells the noise: the check measures steps by it.
    """
    noise = raw.rig.noise
    for steps in COARSE:
        for label, names in one_and_all(raw, 1) if cells(raw) and "tension" in noise else ():
            injector = on_values(names, _rounded(steps * noise["tension"], slice(None)))
            yield Case(f"cells/coarse_steps/{label}/{steps:.0f}_noise", "unknown", names, injector)
        if "imu" in held and "specific_force" in noise:
            injector = on_values(("imu",), _rounded(steps * noise["specific_force"], IMU_FORCE))
            yield Case(f"cells/coarse_steps/imu/{steps:.0f}_noise", "unknown", ("imu",), injector)


def _rounded(step: float, columns: slice) -> Law:
    def law(values: Array) -> Array:
        out = values.copy()
        out[:, columns] = step * np.round(values[:, columns] / step)
        return np.asarray(out)

    return law


def _zeroed(raw: RawSession) -> Iterator[Case]:
    bodies = [r.dummy is not None for r in raw.recordings if r.kind == "static"]
    for label, names in one_and_all(raw, 1):
        if False in bodies:
            yield Case(f"cells/zeroed/body_on/{label}", "zeroed_cell", names, _tared(names, False))
        if True in bodies:
            yield Case(f"cells/zeroed/dummy_on/{label}", "zeroed_cell", names, _tared(names, True))


def _tared(names: tuple[str, ...], dummy: bool) -> Injector:
    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        for name in names:
            raw = on_values((name,), _less(resting_mean(raw, name, dummy)))(raw, rng)
        return raw

    return inject


def _less(zero: Array) -> Law:
    return lambda values: np.asarray(values - zero)


def _gains(raw: RawSession) -> Iterator[Case]:
    one = picked(raw, 2)
    other = picked(raw, 3)
    for gain in GAINS:
        yield Case(
            f"cells/gain_of_another/{one}_{other}/{100 * gain:.0f}_percent",
            "load_cell_gain",
            (one, other),
            _spans_exchanged(one, other, gain),
        )
    # Channel A of an HX711 has a gain of 128 or 64, channel B of 32
    for factor in (0.5, 4.0):
        yield Case(
            f"cells/gain_of_amplifier/{one}/{factor:g}",
            "load_cell_gain",
            (one,),
            on_values((one,), times(factor)),
            also=("unit",),
        )


def _spans_exchanged(one: str, other: str, gain: float) -> Injector:
    """Two cells whose spans differ by ``gain``, each read with the other's span."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        raw = on_values((one,), times(1.0 + gain))(raw, rng)
        return on_values((other,), times(1.0 / (1.0 + gain)))(raw, rng)

    return inject


def _ranges(raw: RawSession, held: tuple[str, ...]) -> Iterator[Case]:
    for k, share in enumerate(BEYOND):
        percent = f"{100 * share:.0f}_percent"
        for label, names in one_and_all(raw, k) if cells(raw) else ():
            name = f"cells/saturated/{label}/{percent}"
            yield Case(name, "saturation", names, _each(names, _clipped(share)))
            for bits in (16, 24):
                name = f"cells/wrapped_{bits}_bits/{label}/{percent}"
                yield Case(name, "wrapped_counts", names, _each(names, _wrapped(share, bits)))
        if "imu" in held:
            name = f"cells/saturated/gyroscope/{percent}"
            yield Case(name, "saturation", ("imu",), _each(("imu",), _clipped_rate(share)))
    for bits in (16, 24) if "imu" in held else ():
        name = f"cells/wrapped_{bits}_bits/gyroscope/sign_lost"
        yield Case(name, "wrapped_counts", ("imu",), _sign_lost(bits))


def _each(names: tuple[str, ...], law_of: LawOf) -> Injector:
    """Injector of a law that is set by what each device itself reads."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        for name in names:
            raw = on_values((name,), law_of(raw, name))(raw, rng)
        return raw

    return inject


def _clipped(share: float) -> LawOf:
    def law_of(raw: RawSession, name: str) -> Law:
        limit = float(np.quantile(moving(raw, name)[:, 0], 1.0 - share))
        return lambda v: np.minimum(v, limit)

    return law_of


def _clipped_rate(share: float) -> LawOf:
    """Both ends of the range of the gyroscope axis that turns most."""

    def law_of(raw: RawSession, name: str) -> Law:
        rates = moving(raw, name)[:, IMU_RATE]
        axis = int(np.argmax(np.std(rates, axis=0)))
        limit = float(np.quantile(np.abs(rates[:, axis]), 1.0 - share))

        def law(values: Array) -> Array:
            out = values.copy()
            out[:, axis] = np.clip(values[:, axis], -limit, limit)
            return np.asarray(out)

        return law

    return law_of


def _wrapped(share: float, bits: int) -> LawOf:
    """Signed counts that wrap around: ``share`` of the moving samples lie beyond half the counter's range."""

    def law_of(raw: RawSession, name: str) -> Law:
        limit = float(np.quantile(moving(raw, name)[:, 0], 1.0 - share))
        half = 2 ** (bits - 1)
        step = limit / half
        return lambda v: step * (np.mod(np.round(v / step) + half, 2 * half) - half)

    return law_of


def _sign_lost(bits: int) -> Injector:
    """Two's complement read as unsigned: negative rates come out a whole counter too high."""

    def law_of(raw: RawSession, name: str) -> Law:
        step = RATE_RANGE / 2 ** (bits - 1)

        def law(values: Array) -> Array:
            out = values.copy()
            out[:, IMU_RATE] = step * np.mod(np.round(values[:, IMU_RATE] / step), 2**bits)
            return np.asarray(out)

        return law

    return _each(("imu",), law_of)
