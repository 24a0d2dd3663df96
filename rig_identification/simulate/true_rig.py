"""The rig as it is: the description with every doubt about it drawn."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import truncnorm

from rig_identification.errors import InputError, did_you_mean
from rig_identification.estimate.parameters import INERTIAL, ParameterSet, parameter_set
from rig_identification.live.plant_effects import PlantEffects, with_effects
from rig_identification.live.plant_switches import effects_of, switches
from rig_identification.model import layout, sensors
from rig_identification.model.motion import RigModel, rig_model
from rig_identification.rig import Rig
from rig_identification.simulate.spec import SessionSpec

Array = NDArray[np.float64]

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

    def drifted(self, device: str, time: Array) -> Array:
        """(N, w) what a device's zeros have moved by, ``time`` (N,) s after a recording's start."""
        if device == "mocap":
            return np.zeros((time.size, 1))
        moved, _ = sensors.drift(time, self.device[self.parameters.places.drift(device)])
        return moved

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
    """The rig with its devices' errors."""
    device, values = true.device.copy(), dict(true.values)
    errors = {p.name: p.index for p in true.parameters.free if p.kind == "device"}
    measured, switched = channels_of(spec), _switched()
    errors |= {n: e for n, e in true.parameters.places.laws().items() if n.split(".")[0] in measured}
    for name, given in spec.effects.items():
        if name in switched:
            continue
        if name not in errors:
            known = ", ".join(sorted([*switched, *errors]))
            near = did_you_mean(name, [*switched, *errors])
            raise InputError(f"effect {name}: is unknown; known are {known}{near}")
        if len(given) != 1 or not np.isfinite(given[0]):
            raise InputError(f"effect {name}: give one finite number")
        device[errors[name]] += given[0]
        values[name] = values.get(name, 0.0) + given[0]
    return replace(true, device=device, values=values)
