"""Stamps that are not the time of measurement.

As reported in public: a driver writes all nanoseconds since 1970 into the 32 bits of ``nanosec``
(bnbhat/bno08x_ros2_driver issue 20, ros-drivers/flir_camera_driver issue 37), a signed fraction into
unsigned ones (KumarRobotics/ublox pull 51), stamps when the host gets round to it (dawonn/vectornav issue
87).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from bench.first_day.faults.base import Case, Injector, cells, devices, on, picked
from rig_identification.raw import RawChannel, RawSession

Stamps = NDArray[np.int64]
StampLaw = Callable[[RawChannel, np.random.Generator], RawChannel]

SECOND = 1_000_000_000
#: Kinds that are one thing in two words: hand-overs in bursts are arrivals, and a queue hands over in bursts;
#: a clock that was never set shows zero, one instant, or seconds since its own start.
ALIKE = (("arrival_time", "usb_bursts"), ("zero_stamps", "simulated_stamps", "other_clock"))
LEAP = 37  # s, TAI less UTC
STEPS = (0.05, 0.5, 30.0)  # s
DRIFTS = (100.0, 300.0, 1000.0)  # ppm
JITTERS = (0.002, 0.006, 0.02)  # s, mean delay beyond the least
UNEVEN = (0.0005, 0.001, 0.002)  # s, std of stamps to either side
BURSTS = (0.008, 0.016, 0.064)  # s between hand-overs


def cases(raw: RawSession) -> Iterator[Case]:
    """All faults of stamps, in one device and in all."""
    held = devices(raw)
    everything = tuple(sorted({c.device for r in raw.recordings for c in r.channels}))
    for place, names in _places(raw, held):
        yield from _written(place, names)
        yield from _clocks(place, names)
        yield from _arrivals(raw, place, names)
        yield from _unset(place, names)
    yield from _written("all", everything)
    yield from _unset("all", everything)


def _unset(place: str, names: tuple[str, ...]) -> Iterator[Case]:
    """Clocks that were never set, or stand still."""
    yield stamp_case("zero_stamps", place, "all_zero", names, on(names, _zero))
    yield stamp_case("simulated_stamps", place, "since_start", names, _since_start(names))
    yield stamp_case("simulated_stamps", place, "never_running", names, on(names, _constant))


def _places(raw: RawSession, held: tuple[str, ...]) -> list[tuple[str, tuple[str, ...]]]:
    """One cell, and each device that is no cell."""
    one = [picked(raw, 5)] if cells(raw) else []
    return [(d, (d,)) for d in (*one, *(d for d in ("imu", "inclinometer", "mocap") if d in held))]


def stamp_case(
    kind: str,
    place: str,
    variant: str,
    names: tuple[str, ...],
    inject: Injector,
    untellable: str = "",
    **expected: float,
) -> Case:
    """A stamp error of all devices, or of ``names``."""
    channels = names if place != "all" else ()
    return Case(
        f"stamps/{kind}/{place}/{variant}",
        "stamp_error",
        channels,
        inject,
        kinds=next((alike for alike in ALIKE if kind in alike), (kind,)),
        untellable=untellable,
        expected=expected,
        within=0.1,
    )


def restamped(law: Callable[[Stamps], Stamps]) -> StampLaw:
    return lambda channel, rng: replace(channel, stamp_ns=law(channel.stamp_ns))


def _written(place: str, names: tuple[str, ...]) -> Iterator[Case]:
    """Seconds and nanoseconds put together wrongly."""
    overflows = {
        "all_in_nanosec": lambda t: t // SECOND * SECOND + t % 2**32,
        "cut_to_32_bits": lambda t: t % 2**32,
        "signed_fraction": _signed_fraction,
    }
    for variant, law in overflows.items():
        yield stamp_case("nanoseconds_overflow", place, variant, names, on(names, restamped(law)))
    for variant, digits in (("nanoseconds", 9), ("microseconds", 6), ("milliseconds", 3)):
        law = _unpadded(digits)
        yield stamp_case("nanoseconds_unpadded", place, variant, names, on(names, restamped(law)))


def _signed_fraction(stamps: Stamps) -> Stamps:
    """Rounded seconds and a fraction of -0.5 to 0.5 s, the negative ones read as unsigned 32 bits."""
    seconds = (stamps + SECOND // 2) // SECOND
    fraction = stamps - seconds * SECOND
    return np.asarray(seconds * SECOND + np.where(fraction < 0, fraction + 2**32, fraction))


def _unpadded(digits: int) -> Callable[[Stamps], Stamps]:
    """The fraction in units of 10^-digits s, printed after the point without its leading zeros."""

    def law(stamps: Stamps) -> Stamps:
        unit = 10 ** (9 - digits)
        fraction = stamps % SECOND // unit
        length = np.maximum(1, np.floor(np.log10(np.maximum(fraction, 1)) + 1e-12).astype(np.int64) + 1)
        return np.asarray(stamps // SECOND * SECOND + fraction * 10 ** (9 - length))

    return law


def _clocks(place: str, names: tuple[str, ...]) -> Iterator[Case]:
    for step in STEPS:
        for sign in (1.0, -1.0):
            variant = f"{sign * step:+g}_s"
            inject = on(names, _stepped(sign * step), ("dynamic",))
            yield stamp_case("clock_step", place, variant, names, inject, offset=step)
    for sign in (1, -1):
        inject = on(names, ahead(sign * LEAP))
        yield stamp_case("leap_seconds", place, f"{sign * LEAP:+d}_s", names, inject, offset=LEAP)
    for drift in DRIFTS:
        for sign in (1.0, -1.0):
            variant = f"{sign * drift:+g}_ppm"
            inject = on(names, _drifting(sign * drift))
            yield stamp_case("clock_drift", place, variant, names, inject, drift=drift)


def ahead(seconds: int) -> StampLaw:
    return restamped(lambda stamps: stamps + seconds * SECOND)


def _stepped(step: float) -> StampLaw:
    """The device's clock is set in the middle of the recording."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        at = int(rng.uniform(0.3, 0.7) * len(channel.stamp_ns))
        stamps = channel.stamp_ns.copy()
        stamps[at:] += round(step * SECOND)
        return replace(channel, stamp_ns=stamps)

    return change


def _drifting(ppm: float) -> StampLaw:
    """The clock was set right when the recording began, and runs fast by ``ppm``."""

    def law(stamps: Stamps) -> Stamps:
        return np.asarray(stamps + np.round(ppm * 1e-6 * (stamps - stamps[0])).astype(np.int64))

    return restamped(law)


#: Nats that a device's readings have to tell of its stamps before anything could: one in ten.
TELLS = float(np.log(10.0))
#: s over which a reading's rate of change is taken.
SMOOTH = 0.5


def _late_by(raw: RawSession, names: tuple[str, ...], spread: float) -> float:
    """Nats that readings tell of stamps late by ``spread`` s (std): what they change by it over noise."""
    told = 0.0
    for channel in (c for r in raw.recordings for c in r.channels if c.device in names):
        step = float(np.median(np.diff(channel.stamp_ns))) / SECOND
        window = max(5, round(SMOOTH / step) | 1)
        if len(channel.values) <= window:
            continue
        rate = savgol_filter(channel.values, window, 2, deriv=1, delta=step, axis=0)
        noise = np.sqrt(np.mean(np.diff(channel.values, n=2, axis=0) ** 2, axis=0) / 6.0)
        told += 0.5 * float(np.sum((spread * rate / np.maximum(noise, 1e-12)) ** 2))
    return told


def _slower(raw: RawSession, names: tuple[str, ...], interval: float) -> bool:
    """Whether the devices measure more seldom than a driver hands over: samples come one by one."""
    steps = [np.median(np.diff(c.stamp_ns)) for r in raw.recordings for c in r.channels if c.device in names]
    return bool(np.min(steps) > interval * SECOND)


def _arrivals(raw: RawSession, place: str, names: tuple[str, ...]) -> Iterator[Case]:
    for jitter in JITTERS:
        variant = f"{1000 * jitter:g}_ms"
        yield stamp_case("arrival_time", place, variant, names, on(names, _arrived(jitter)))
    for spread in UNEVEN:
        variant = f"{1000 * spread:g}_ms"
        yield stamp_case("jitter", place, variant, names, on(names, _uneven(spread)), jitter=spread)
    for interval in BURSTS:
        variant = f"{1000 * interval:g}_ms"
        # What is slower than the bursts comes one by one: stamps alone do not tell it from a device that
        # measures at every second or third tick of a quicker clock. Its readings do, where they change
        idle = _slower(raw, names, interval) and _late_by(raw, names, interval / np.sqrt(12.0)) < TELLS
        untellable = "its readings hardly change in the time by which its stamps are off" if idle else ""
        yield stamp_case("usb_bursts", place, variant, names, on(names, _burst(interval)), untellable)


HANDED_ON = 200_000  # ns from the stamp to the recorder
LEAST_DELAY = 0.002  # s


def _uneven(spread: float) -> StampLaw:
    """Stamped early as often as late, in order."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        off = np.round(rng.normal(0.0, spread, len(channel.stamp_ns)) * SECOND).astype(np.int64)
        return replace(channel, stamp_ns=np.sort(channel.stamp_ns + off))

    return change


def _arrived(jitter: float) -> StampLaw:
    """Stamped by the host when a message comes in: late by a least delay and a queue's."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        late = LEAST_DELAY + rng.exponential(jitter, len(channel.stamp_ns))
        arrived = channel.stamp_ns + np.round(late * SECOND).astype(np.int64)
        # In order, and no two at once
        arrived = np.maximum.accumulate(arrived) + 1000 * np.arange(len(arrived))
        return replace(channel, stamp_ns=arrived, received_ns=arrived + HANDED_ON)

    return change


def _burst(interval: float) -> StampLaw:
    """Handed over by a USB driver every ``interval``, now and then after a stall of 0.1 s."""

    def change(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
        phase = int(channel.stamp_ns[0]) - round(rng.uniform(0.0, interval) * SECOND)
        slot = np.ceil((channel.stamp_ns - phase) / (interval * SECOND))
        handed = phase + np.round(slot * interval * SECOND).astype(np.int64)
        span = (int(channel.stamp_ns[-1]) - int(channel.stamp_ns[0])) / SECOND
        for begin in rng.uniform(0.0, span, rng.poisson(0.2 * span)):
            start = int(channel.stamp_ns[0]) + round(begin * SECOND)
            stalled = (handed >= start) & (handed < start + SECOND // 10)
            handed = np.where(stalled, start + SECOND // 10, handed)
        # 70 us from one sample of a hand-over to the next
        first = np.searchsorted(handed, handed, side="left")
        stamps = handed + 70_000 * (np.arange(len(handed)) - first)
        stamps = np.maximum.accumulate(stamps)
        return replace(channel, stamp_ns=stamps, received_ns=stamps + HANDED_ON)

    return change


def _zero(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
    return replace(channel, stamp_ns=np.zeros_like(channel.stamp_ns))


def _constant(channel: RawChannel, rng: np.random.Generator) -> RawChannel:
    """A simulated clock that nothing drives: every message has the first stamp."""
    return replace(channel, stamp_ns=np.full_like(channel.stamp_ns, channel.stamp_ns[0]))


def _since_start(names: tuple[str, ...]) -> Injector:
    """Seconds since the device or the simulation was switched on, some minutes before the session."""

    def inject(raw: RawSession, rng: np.random.Generator) -> RawSession:
        first = min(int(c.stamp_ns[0]) for r in raw.recordings for c in r.channels)
        start = first - round(rng.uniform(20.0, 300.0) * SECOND)
        return on(names, restamped(lambda t: t - start))(raw, rng)

    return inject
