"""The rig as it is: the description with every doubt about it drawn."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import truncnorm

from rig_identification.errors import InputError, did_you_mean
from rig_identification.estimate.lag import lagged
from rig_identification.estimate.mounting import Answer, mounted
from rig_identification.estimate.parameters import (
    INERTIAL,
    MOUNT_SIZE,
    MOUNTED,
    DeviceLayout,
    ParameterSet,
    parameter_set,
)
from rig_identification.live.plant_effects import PlantEffects, with_effects
from rig_identification.live.plant_switches import effects_of, switches
from rig_identification.model import layout, sensors
from rig_identification.model.motion import RigModel, rig_model
from rig_identification.rig import Rig
from rig_identification.simulate.spec import SessionSpec

Array = NDArray[np.float64]

#: What an exciter's own switches begin with, beside its gain.
MOUNT_OF_EXCITER = ("exciter.position.", "exciter.orientation.")
#: Doubts are cut at so many tolerances: what lies beyond would be a finding.
CUT = 3.0


@dataclass(frozen=True)
class TrueRig:
    """Numbers that motion and readings come from, under the names that the estimator gives them."""

    model: RigModel
    device: Array  # the devices' own numbers (estimate/parameters.py, DeviceLayout)
    parameters: ParameterSet
    values: dict[str, float]  # parameter name -> true value
    described: Rig  # description, with the scale's reading of the mass
    effects: PlantEffects = field(default_factory=PlantEffects)  # left-out physics, in ``model`` already

    def late(self, device: str) -> float:
        """By how much the stamps of a device are late, s."""
        return float(self.device[self.parameters.places.clock(device)])

    def drifted(self, device: str, time: Array, values: Array) -> Array:
        """(N, w) what a device reads of ``values`` (N, w), ``time`` (N,) s after a recording's start."""
        if device == "mocap":
            return values
        return sensors.drift(time, self.device[self.parameters.places.drift(device)]).read(values)

    def shown(self, device: str, step: float, values: Array) -> Array:
        """(N, w) what a device shows of its readings ``values`` (N, w), ``step`` s apart."""
        places, out = self.parameters.places, values
        if device == "imu":
            # Columns of the gyroscope, then of the accelerometer (sensors.imu)
            parts = zip(("angular_rate", "specific_force"), (values[:, :3], values[:, 3:]), strict=True)
            mounts = [(self.device[places.mount(q) :][:MOUNT_SIZE], part) for q, part in parts]
            out = np.hstack([mounted(step, Answer(*own.tolist()), part) for own, part in mounts])
        return lagged(step, float(self.device[places.lag(device)]), out)

    @property
    def R_body_exciter(self) -> Array:
        """(3, 3) true orientation of the exciter frame."""
        error = self.model.physics[layout.EXCITER_ROTATION : layout.EXCITER_ROTATION + 3]
        return np.asarray(Rotation.from_rotvec(error).as_matrix() @ self.model.exciter_orientation)


def channels_of(spec: SessionSpec) -> set[str]:
    """Devices that record: cable names, imu, inclinometer, mocap."""
    rates, rig = spec.rates, spec.rig
    found = {cable.name for cable in rig.cables} if rates.tension > 0.0 else set()
    if rates.imu > 0.0 and rig.imu is not None:
        found.add("imu")
    if rates.inclinometer > 0.0 and rig.inclinometer is not None:
        found.add("inclinometer")
    if rates.mocap > 0.0:
        found.add("mocap")
    return found


def draw_true_rig(spec: SessionSpec, rng: np.random.Generator) -> TrueRig:
    """The true rig of a session; the description itself where ``spec.doubts`` and ``spec.effects`` are off.

    Raises InputError where an effect is unknown or makes no sense.
    """
    model = rig_model(spec.rig, spec.elements, rods=spec.rods)
    parameters = parameter_set(spec.rig, model, channels_of(spec))
    theta = parameters.start(spec.elements)
    described = spec.rig
    if spec.doubts:
        drawn = truncnorm.rvs(-CUT, CUT, size=len(parameters.free), random_state=rng)
        # A mount that no one described is not a doubt: it stays where the simulation puts it
        theta[INERTIAL:] = np.where([p.unknown for p in parameters.free], 0.0, drawn)
        theta[INERTIAL:] = [
            spec.given_doubts.get(p.name, at) for p, at in zip(parameters.free, theta[INERTIAL:], strict=True)
        ]
        if described.mass is not None and described.mass_std is not None:
            reading = float(spec.elements[0]) + described.mass_std * float(rng.standard_normal())
            described = replace(described, mass=reading if spec.scale_reading is None else spec.scale_reading)
    values = {p.name: float(v) for p, v in zip(parameters.free, parameters.values(theta), strict=True)}
    true = model.with_physics(parameters.physics(theta))
    out = TrueRig(true, parameters.device(theta), parameters, values, described)
    return _with_device_errors(_with_physics(out, spec), spec) if spec.effects else out


def _switched() -> frozenset[str]:
    return frozenset(switch.name for switch in switches())


def _with_physics(true: TrueRig, spec: SessionSpec) -> TrueRig:
    """The rig with its plant's effects."""
    switched = _switched()
    given = {name: values for name, values in spec.effects.items() if name in switched}
    effects = effects_of(given, true.model, "effect ")
    return replace(true, model=with_effects(true.model, effects), effects=effects)


def _with_device_errors(true: TrueRig, spec: SessionSpec) -> TrueRig:
    """The rig with errors of its devices, and of the exciter's place and orientation."""
    device, physics, values = true.device.copy(), true.model.physics.copy(), dict(true.values)
    errors = {p.name: p.index for p in true.parameters.free if p.kind == "device"}
    measured, switched = channels_of(spec), _switched()
    errors |= {n: e for n, e in _beside_doubts(true.parameters.places).items() if n.split(".")[0] in measured}
    placed = {p.name: p.index for p in true.parameters.free if p.name.startswith(MOUNT_OF_EXCITER)}
    if spec.rig.exciter is not None:
        errors["exciter.lag"] = true.parameters.places.lag("exciter")
    for name, given in spec.effects.items():
        if name in switched:
            continue
        if name not in errors and name not in placed:
            every = sorted([*switched, *errors, *placed])
            near = did_you_mean(name, every)
            raise InputError(f"effect {name}: is unknown; known are {', '.join(every)}{near}")
        if len(given) != 1 or not np.isfinite(given[0]):
            raise InputError(f"effect {name}: give one finite number")
        (numbers, entry) = (device, errors[name]) if name in errors else (physics, placed[name])
        numbers[entry] += given[0]
        values[name] = values.get(name, 0.0) + given[0]
    return replace(true, model=true.model.with_physics(physics), device=device, values=values)


def _beside_doubts(places: DeviceLayout) -> dict[str, int]:
    """Entries, by name, of what the ideal model has no doubt about: laws, lags, soft mounts, zeros."""
    out = places.laws()
    out |= {f"{d}.lag": places.lag(d) for d in (*places.cables, "imu", "inclinometer", "mocap")}
    for quantity in MOUNTED:
        for i, number in enumerate(("softness", "damping", "delay")):
            out[f"imu.mount.{quantity}.{number}"] = places.mount(quantity) + i
    return out | {f"inclinometer.zero.{a}": places.inclinometer + 3 + i for i, a in enumerate("xy")}
