"""The truth of a session, in the words and units of the recording contract."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect
from bench.concealed.inertia import take_away
from bench.concealed.scene import Body, Scene
from bench.concealed.signals import Samples, Trajectory

# Channel of "effect_over_noise": devices, columns, name of the noise.
CHANNELS = {
    "acc": ("imu", slice(3, 6), "specific_force"),
    "gyr": ("imu", slice(0, 3), "angular_rate"),
    "inc": ("inclinometer", slice(None), "inclination"),
    "exc": ("exciter", slice(None), "exciter_force"),
}


def describe(scene: Scene, effects: Sequence[Effect], paths: Sequence[Trajectory]) -> dict[str, Any]:
    """Everything a scorer needs to know; no estimate may read it."""
    names, rigid = scene.geometry.names, scene.body
    for effect in effects:
        rigid = effect.rigid_part(rigid)
    found = [_finding(e, scene, paths) for e in effects]
    accept = sorted({a for entry in found for a in entry["accept"]}) or ["none"]
    return {
        "case": f"concealed_{scene.seed}",
        "seed": scene.seed,
        "rig_desc": scene.geometry_name,
        **_body(scene.body),
        "rigid_part": _body(rigid),
        "without_frame": _without_frame(scene),
        "effects": found,
        "outside": any(e.outside for e in effects),
        "accept_first": accept,
        "verdict": _verdicts(effects),
        "sensor_biases": _errors(scene),
        "true_rig": {
            "ceiling_points": dict(zip(names, scene.geometry.ceiling.tolist(), strict=True)),
            "body_points": dict(zip(names, scene.geometry.hinge.tolist(), strict=True)),
            "lengths": dict(zip(names, scene.geometry.length.tolist(), strict=True)),
            "imu_position": scene.devices.imu_position.tolist(),
            "imu_orientation": Rotation.from_matrix(scene.devices.imu_rotation).as_quat().tolist(),
            "inclinometer_orientation": Rotation.from_matrix(scene.devices.inclinometer_rotation)
            .as_quat()
            .tolist(),
            "exciter_position": scene.devices.exciter_position.tolist(),
            "exciter_orientation": Rotation.from_matrix(scene.devices.exciter_rotation).as_quat().tolist(),
        },
        "runs": {p.name: _run(scene, k, paths[k]) for k, p in enumerate(scene.plans)},
    }


def _finding(effect: Effect, scene: Scene, paths: Sequence[Trajectory]) -> dict[str, Any]:
    truth = effect.truth()
    where = {"channel": None, "axis": None, **truth.get("where", {}), **(effect.observe(scene, paths) or {})}
    return {
        "effect": effect.name,
        "outside": effect.outside,
        "where": where,
        "parameters": truth["parameters"],
        "accept": ["unknown"] if effect.outside else [effect.name],
        "near": list(effect.near),
    }


def _verdicts(effects: Sequence[Effect]) -> list[str]:
    if not effects:
        return ["none"]
    return ["unexplained", "explained"] if any(e.outside for e in effects) else ["explained"]


def _errors(scene: Scene) -> dict[str, Any]:
    e = scene.errors
    return {
        "ten": e.tension_zero.tolist(),
        "ten_gain": e.tension_gain.tolist(),
        "acc": e.acceleration_bias.tolist(),
        "acc_scale": e.acceleration_scale.tolist(),
        "gyr": e.rate_bias.tolist(),
        "gyr_scale": e.rate_scale.tolist(),
        "exc_gain": e.force_gain,
        "inc": e.inclination_zero.tolist(),
        "clock": dict(e.clock),
    }


def _run(scene: Scene, index: int, path: Trajectory) -> dict[str, Any]:
    plan = scene.plans[index]
    out: dict[str, Any] = {
        "start": plan.start,
        "q0": [*path.position[0].tolist(), *path.quaternion[0, [3, 0, 1, 2]].tolist()],
        "first_sample": plan.first_sample,
        "min_tension": path.tension.min(axis=0).tolist(),
        "max_stretch": float(np.abs(path.stretch).max()),
        "motion": {
            "position_range_m": np.ptp(path.position, axis=0).tolist(),
            "rate_rms": np.sqrt(np.mean(path.rate**2, axis=0)).tolist(),
            "accel_rms": np.sqrt(np.mean(path.acceleration**2, axis=0)).tolist(),
        },
    }
    if plan.motor is not None:
        out["frequency_hz"] = plan.motor.frequency
        out["exciter_unbalance_kg_m"] = plan.motor.unbalance
        out["force_n"] = plan.motor.unbalance * (2.0 * np.pi * plan.motor.frequency) ** 2
    return out


def _without_frame(scene: Scene) -> dict[str, Any] | None:
    frame = scene.rig.frame
    if frame is None:
        return None
    return _body(take_away(scene.body, Body(frame.mass, frame.center_of_mass, frame.inertia)))


def _body(body: Body) -> dict[str, Any]:
    return {
        "mass": body.mass,
        "center_of_mass": body.center_of_mass.tolist(),
        "inertia": body.inertia.tolist(),
    }


def channel_differences(
    clean: Mapping[str, Samples], other: Mapping[str, Samples], scene: Scene
) -> dict[str, float]:
    """Root mean square difference by channel, in units of noise, both free of it."""
    out = {}
    for name, (device, columns, noise) in CHANNELS.items():
        out[name] = _difference(clean[device], other[device], columns) / scene.rig.noise[noise]
    squares = [_difference(clean[c], other[c], slice(None)) ** 2 for c in scene.geometry.names]
    out["ten"] = float(np.sqrt(np.mean(squares))) / scene.rig.noise["tension"]
    return out


def _difference(clean: Samples, other: Samples, columns: slice) -> float:
    values = other.values[:, columns]
    # Read at the stamps of the clean device: an effect on the clock shows as a change of value.
    at = np.stack([np.interp(clean.time, other.time, v) for v in values.T], axis=1)
    return float(np.sqrt(np.mean((at - clean.values[:, columns]) ** 2)))
