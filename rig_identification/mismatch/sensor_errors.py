"""Sensor errors beyond what the lab believes: a doubt of the ideal model, freed."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.parameters import AXES, Parameter, ParameterSet
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Plausible range (std of the prior once freed) of each error.
RANGE = {
    "load_cell_gain": 0.05,
    "load_cell_zero": 200.0,
    "gyroscope_bias": 0.05,
    "accelerometer_bias": 1.0,
    "gyroscope_scale": 0.05,
    "accelerometer_scale": 0.05,
    "position": 0.1,
    "orientation": 0.1,
    "clock": 0.05,
    "gain": 0.05,
    "zero": 0.05,
    "lag": 0.02,
}


def freed(parameters: ParameterSet, name: str, std: float) -> Parameter | None:
    """A free parameter with the wide prior; None where the session has it not."""
    for p in parameters.free:
        if p.name == name:
            wide = max(std, 10.0 * p.prior_std)
            return Parameter(name, p.unit, p.nominal, wide, p.kind, p.index, bounded=False, freed=True)
    return None


def _one(
    parameters: ParameterSet,
    effect: str,
    name: str,
    std: float,
    told: str,
    sentence: str,
    advice: str,
    where: dict[str, object],
) -> list[Candidate]:
    p = freed(parameters, name, std)
    if p is None:
        return []
    return [Candidate(effect, (p,), sentence, advice, where, name_in_result=told)]


def _load_cells(rig: Rig, parameters: ParameterSet) -> list[Candidate]:
    out: list[Candidate] = []
    for cable in rig.cables:
        where: dict[str, object] = {"channel": cable.name, "axis": None}
        out += _one(
            parameters,
            "load_cell_gain",
            f"{cable.name}.load_cell_gain",
            RANGE["load_cell_gain"],
            "gain",
            "The load cell of {channel} has a scale error of {value}: it reads that share too high.",
            "Calibrate the cell with a known weight.",
            where,
        )
        out += _one(
            parameters,
            "load_cell_offset",
            f"{cable.name}.load_cell_zero",
            RANGE["load_cell_zero"],
            "offset",
            "The load cell of {channel} reads {value} at no load.",
            "Zero the cell while the cable hangs free.",
            where,
        )
    return out


def _imu(rig: Rig, parameters: ParameterSet) -> list[Candidate]:
    out: list[Candidate] = []
    for a in AXES:
        where: dict[str, object] = {"channel": "imu", "axis": a}
        for kind, quantity, unit_name in (
            ("gyroscope", "angular_rate", "gyroscope"),
            ("accelerometer", "specific_force", "accelerometer"),
        ):
            out += _one(
                parameters,
                "imu_bias",
                f"imu.{kind}_bias.{a}",
                RANGE[f"{kind}_bias"],
                quantity,
                f"The {unit_name}'s {a} axis reads {{value}} too much.",
                "Average the unit at rest and take the mean off, or replace it.",
                where,
            )
            out += _one(
                parameters,
                "imu_scale",
                f"imu.{kind}_scale.{a}",
                RANGE[f"{kind}_scale"],
                "scale",
                f"The {unit_name}'s {a} axis has a scale error of {{value}}.",
                "Calibrate the unit on a turntable, or against gravity in six positions.",
                where,
            )
        out += _one(
            parameters,
            "imu_position",
            f"imu.position.{a}",
            RANGE["position"],
            "error",
            f"The IMU sits {{value}} from where it is described, along the body's {a} axis.",
            "Measure its place again.",
            where,
        )
    if rig.imu is not None:
        out += turned(parameters, "imu", "The IMU", "imu_misalignment", rig.imu.orientation)
    return out


def turned(
    parameters: ParameterSet, device: str, subject: str, effect: str, orientation: Array
) -> list[Candidate]:
    """A device that is turned against its description; nothing where no turn of it is doubted.

    orientation (4,): described quaternion, device into body.
    """
    names = [f"{device}.orientation.{a}" for a in AXES]
    own = tuple(p for name in names if (p := freed(parameters, name, RANGE["orientation"])) is not None)
    if len(own) < len(AXES):
        return []
    to_device = Rotation.from_quat(orientation).inv()

    def about(axis: int, *turn: float) -> float:
        return float(to_device.apply(turn)[axis])

    def angle(found: Estimates) -> Told:
        turns: Told = {
            f"angle_{a}": (*found.following(partial(about, i), *names), "rad") for i, a in enumerate(AXES)
        }
        return {"angle": max(turns.values(), key=lambda told: abs(told[0])), **turns}

    return [
        Candidate(
            effect,
            own,
            f"{subject} is turned by {{value}} against its description.",
            "Measure its orientation again; the angles about its own axes are given.",
            {"channel": device, "axis": None},
            tell=angle,
        )
    ]


def _inclinometer(parameters: ParameterSet) -> list[Candidate]:
    out = []
    if any(p.name.startswith("inclinometer.orientation") for p in parameters.free):
        for i, a in enumerate("xy"):
            entry = parameters.places.inclinometer + 3 + i
            p = Parameter(f"inclinometer.zero.{a}", "rad", 0.0, RANGE["zero"], "device", entry, bounded=False)
            out.append(
                Candidate(
                    "inclinometer_offset",
                    (p,),
                    f"The inclinometer's {a} axis reads {{value}} too much.",
                    "Turn the inclinometer by 180 degrees on a level plate and halve the difference.",
                    {"channel": "inclinometer", "axis": a},
                    name_in_result="offset",
                )
            )
    return out


def _clocks_and_exciter(parameters: ParameterSet) -> list[Candidate]:
    out: list[Candidate] = []
    for device in ("imu", "inclinometer", "exciter", "mocap"):
        out += _one(
            parameters,
            "clock_offset",
            f"{device}.clock",
            RANGE["clock"],
            "offset",
            f"The stamps of {device} are {{value}} late.",
            "Synchronise the devices' clocks, or check for a buffer in the driver.",
            {"channel": device, "axis": None},
        )
    gain = freed(parameters, "exciter.gain", RANGE["gain"])
    if gain is not None:

        def reads_high(found: Estimates) -> Told:
            # The model multiplies what was measured; the contract asks how much too high it reads
            return {"gain": (*found.following(lambda factor: 1.0 / factor - 1.0, "exciter.gain"), "1")}

        out.append(
            Candidate(
                "exciter_gain",
                (gain,),
                "The exciter's force cells have a scale error of {value}.",
                "Calibrate the force cells under the motor.",
                {"channel": "exciter", "axis": None},
                tell=reads_high,
            )
        )
    return out


def _added(
    effect: str,
    name: str,
    entries: tuple[int, ...],
    std: float,
    told: str,
    text: tuple[str, str],
    channel: str | None,
    ordinary: float,
) -> Candidate:
    """A time error that the ideal model has no doubt about. ordinary: s, by which clocks differ anyway."""
    first, *others = entries
    p = Parameter(name, "s", 0.0, std, "device", first, bounded=False, also=tuple(others))
    where: dict[str, object] = {"channel": channel, "axis": None}
    return Candidate(
        effect,
        (p,),
        text[0],
        text[1],
        where,
        positive=int(effect == "sensor_lag"),
        name_in_result=told,
        ordinary={name: ordinary},
    )


def _time_errors(rig: Rig, parameters: ParameterSet, devices: list[str]) -> list[Candidate]:
    """Lags of every device, late stamps of load cells, which keep the time where nothing is wrong."""
    places, ordinary = parameters.places, rig.tolerance["clock"]
    out = []
    lag = (
        "{channel} follows what it measures like a low-pass with a time constant of {value}.",
        "Switch its filter off, or take its time constant from the data sheet into the model.",
    )
    late = (
        "The stamps of {channel} are {value} late.",
        "Synchronise the devices' clocks, or check for a buffer in the driver.",
    )
    for device in devices:
        out.append(
            _added(
                "sensor_lag",
                f"{device}.lag",
                (places.lag(device),),
                RANGE["lag"],
                "time_constant",
                lag,
                device,
                ordinary,
            )
        )
        if device in places.cables:
            entry = (places.clock(device),)
            name = f"{device}.clock"
            out.append(_added("clock_offset", name, entry, RANGE["clock"], "offset", late, device, ordinary))
    cells = tuple(d for d in devices if d in places.cables)
    if len(cells) > 1:
        every = tuple(
            text.replace("{channel}", "all load cells").replace("follows", "follow") for text in lag
        )
        entries = tuple(places.lag(c) for c in cells)
        out.append(
            _added(
                "sensor_lag",
                "load_cells.lag",
                entries,
                RANGE["lag"],
                "time_constant",
                (every[0], every[1]),
                None,
                ordinary,
            )
        )
    return out


def sensor_errors(rig: Rig, parameters: ParameterSet, devices: list[str]) -> list[Candidate]:
    """All sensor errors that this session's channels could have. devices: those that the runs hold."""
    return [
        *_load_cells(rig, parameters),
        *_imu(rig, parameters),
        *_inclinometer(parameters),
        *_clocks_and_exciter(parameters),
        *_time_errors(rig, parameters, devices),
    ]
