"""Readings in another unit than the contract's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rig_identification.check.consistency.evidence import EVERYTHING, Evidence
from rig_identification.check.consistency.hypothesis import Change, Hypothesis, Reading, fault
from rig_identification.check.consistency.rest import RestFit
from rig_identification.examination import SetupFault
from rig_identification.rig import Cable, Mount, Rig

Array = NDArray[np.float64]

POUND, GRAVITY, INCH = 0.45359237, 9.80665, 0.0254
#: Unit -> what one of it is in the contract's unit.
FORCES = {"kgf": GRAVITY, "gf": GRAVITY / 1000.0, "lbf": POUND * GRAVITY, "kN": 1000.0, "mN": 0.001}
ACCELERATIONS = {"g": GRAVITY, "milli-g": GRAVITY / 1000.0}
RATES = {"degrees per second": np.pi / 180.0, "rpm": np.pi / 30.0}
ANGLES = {"degrees": np.pi / 180.0, "milliradians": 0.001}
LENGTHS = {"mm": 0.001, "cm": 0.01, "inches": INCH, "feet": 12.0 * INCH}
#: A rig's cables differ in length by less than this factor: a length in another unit stands out by more.
APART = 10.0


def hypotheses(evidence: Evidence) -> Iterator[Hypothesis]:
    """Every unit of every device; cells all together and each by itself."""
    cells = [c.name for c in evidence.session.rig.cables]
    for unit, factor in FORCES.items():
        yield _device(tuple(cells), slice(None), "tension", "N", unit, factor, frozenset(cells))
        for cell in cells:
            yield _device((cell,), slice(None), "tension", "N", unit, factor, frozenset(cells))
        yield _device(("exciter",), slice(None), "force", "N", unit, factor, frozenset(["exciter"]))
    yield from _imu()
    for unit, factor in ANGLES.items():
        yield _device(
            ("inclinometer",), slice(None), "angles", "rad", unit, factor, frozenset(["inclinometer"])
        )
    for unit, factor in LENGTHS.items():
        yield _description(unit, factor)
        if evidence.session.rig.imu is not None:
            yield _imu_position(unit, factor)
        others = float(np.median([c.length for c in evidence.session.rig.cables]))
        for cable in evidence.session.rig.cables:
            if others / APART < factor * cable.length:
                yield _cable_length(cable.name, unit, factor)
        yield from _dummy_places(evidence, unit, factor)


def _device(
    devices: tuple[str, ...],
    columns: slice,
    quantity: str,
    right: str,
    unit: str,
    factor: float,
    about: frozenset[str],
) -> Hypothesis:
    change = Change({device: scaled(columns, factor) for device in devices})
    name = "the load cells" if len(devices) > 1 else _named(devices[0])
    channel: object = devices[0] if len(devices) == 1 else list(devices)

    def describe(rest: RestFit | None) -> SetupFault:
        verb = "are" if quantity == "angles" else "is"
        return fault(
            "unit",
            {"channel": channel, "quantity": quantity.replace(" ", "_"), "unit": unit},
            {"factor": (factor, 0.0, f"{right} per {unit}")},
            f"The {quantity} of {name} {verb} recorded in {unit}, not in {right}.",
            f"Multiply by {factor:.6g} in the driver: publish {right}.",
        )

    return Hypothesis(change, describe, about, variants=len(FORCES))


def _imu() -> Iterator[Hypothesis]:
    """Units of the IMU's two halves, one or both in a driver's own: g and degrees per second go together."""
    force, rate = frozenset(["imu.accelerometer"]), frozenset(["imu.gyroscope"])
    for unit, factor in ACCELERATIONS.items():
        yield _device(("imu",), slice(3, 6), "specific force", "m/s^2", unit, factor, force)
    for unit, factor in RATES.items():
        yield _device(("imu",), slice(0, 3), "angular rate", "rad/s", unit, factor, rate)
    for (unit, factor), (other, share) in product(ACCELERATIONS.items(), RATES.items()):
        yield _both_halves(unit, factor, other, share)


def _both_halves(force: str, factor: float, rate: str, share: float) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "unit",
            {"channel": "imu", "quantity": ["specific_force", "angular_rate"], "unit": [force, rate]},
            {"factor": (factor, 0.0, f"m/s^2 per {force}"), "rate_factor": (share, 0.0, f"rad/s per {rate}")},
            f"The IMU is recorded in {force} and {rate}, not in m/s^2 and rad/s.",
            f"Multiply the specific force by {factor:.6g} and the angular rate by {share:.6g} in the driver.",
        )

    factors = np.repeat([share, factor], 3)
    # Without any IMU the motion may be unknown, and a first-order step from there tells nothing
    return Hypothesis(
        Change({"imu": lambda values, _: values * factors}), describe, frozenset(["imu"]),
        variants=len(ACCELERATIONS) * len(RATES), fresh=True,
    )  # fmt: skip


def scaled(columns: slice, factor: float) -> Reading:
    """Readings whose columns are multiplied by a factor."""

    def right(values: Array, _: str) -> Array:
        out: Array = np.array(values)
        out[:, columns] *= factor
        return out

    return right


def _named(device: str) -> str:
    return f"the cell of {device}" if device not in ("imu", "inclinometer", "exciter") else f"the {device}"


def _description(unit: str, factor: float) -> Hypothesis:
    def describe(rest: RestFit | None) -> SetupFault:
        return fault(
            "unit",
            {"channel": "description", "quantity": "length", "unit": unit},
            {"factor": (factor, 0.0, f"m per {unit}")},
            f"The positions and lengths of the rig description are in {unit}, not in m.",
            f"Multiply every position and length of the rig description by {factor:g}.",
        )

    return Hypothesis(
        Change(rig=lambda rig: _in_metres(rig, factor)), describe, frozenset([EVERYTHING]),
        variants=len(LENGTHS), fresh=True,
    )  # fmt: skip


def _imu_position(unit: str, factor: float) -> Hypothesis:
    def right(rig: Rig) -> Rig:
        mount = rig.imu
        return rig if mount is None else replace(rig, imu=replace(mount, position=factor * mount.position))

    describe = _told("imu", "position", "The IMU's position in the rig description", unit, factor)
    return Hypothesis(
        Change(rig=right), describe, frozenset(["imu.accelerometer"]), variants=len(LENGTHS), fresh=True
    )


def _cable_length(name: str, unit: str, factor: float) -> Hypothesis:
    def right(rig: Rig) -> Rig:
        cables = (replace(c, length=factor * c.length) if c.name == name else c for c in rig.cables)
        return replace(rig, cables=tuple(cables))

    describe = _told(name, "length", f"The length of {name} in the rig description", unit, factor)
    return Hypothesis(Change(rig=right), describe, frozenset(["rest"]), variants=len(LENGTHS), fresh=True)


def _dummy_places(evidence: Evidence, unit: str, factor: float) -> Iterator[Hypothesis]:
    loaded = {r.name: r.dummy for r in evidence.session.recordings if r.dummy is not None}
    size = max(float(np.max(np.abs(c.body_point))) for c in evidence.session.rig.cables)
    if any(np.max(np.abs(dummy.position)) > APART * size for dummy in loaded.values()):
        dummies = {name: replace(dummy, position=factor * dummy.position) for name, dummy in loaded.items()}
        describe = _told("session", "dummy_position", "The place of the known mass", unit, factor)
        yield Hypothesis(
            Change(dummies=dict(dummies)), describe, frozenset(["rest"]), variants=len(LENGTHS), fresh=True
        )


def _told(
    channel: str, quantity: str, what: str, unit: str, factor: float
) -> Callable[[RestFit | None], SetupFault]:
    def describe(rest: RestFit | None) -> SetupFault:
        where = {"channel": channel, "quantity": quantity, "unit": unit}
        numbers = {"factor": (factor, 0.0, f"m per {unit}")}
        return fault("unit", where, numbers, f"{what} is in {unit}, not in m.", f"Multiply it by {factor:g}.")

    return describe


def _in_metres(rig: Rig, factor: float) -> Rig:
    def cable(one: Cable) -> Cable:
        return replace(
            one,
            ceiling_point=factor * one.ceiling_point,
            body_point=factor * one.body_point,
            length=factor * one.length,
        )

    def mount(one: Mount | None) -> Mount | None:
        return None if one is None else replace(one, position=factor * one.position)

    return replace(
        rig,
        cables=tuple(cable(c) for c in rig.cables),
        imu=mount(rig.imu),
        exciter=mount(rig.exciter),
        mocap=mount(rig.mocap),
    )
