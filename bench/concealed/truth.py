"""The truth of a session, in the words and units of the recording contract."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect
from bench.concealed.engine import Trajectory
from bench.concealed.measure import Samples
from bench.concealed.scene import Body, Scene

# Channel of "effect_over_noise": devices, columns, name of the noise.
CHANNELS = {
    "acc": ("imu", slice(3, 6), "specific_force"),
    "gyr": ("imu", slice(0, 3), "angular_rate"),
    "inc": ("inclinometer", slice(None), "inclination"),
    "exc": ("exciter", slice(None), "exciter_force"),
}


def describe(scene: Scene, effects: Sequence[Effect], paths: Sequence[Trajectory]) -> dict[str, Any]:
    """Everything a scorer needs to know; no estimate may read it."""
    body, names = scene.body, scene.geometry.names
    found = [{"effect": e.name, **e.truth()} for e in effects]
    for entry in found:
        entry.setdefault("where", {})
        entry.setdefault("accept", [entry["effect"]])
    outside = any(e.outside for e in effects)
    accept = sorted({a for entry in found for a in entry["accept"]}) or ["none"]
    return {
        "case": f"concealed_{scene.seed}",
        "seed": scene.seed,
        "rig_desc": scene.geometry_name,
        "mass": body.mass,
        "center_of_mass": body.center_of_mass.tolist(),
        "inertia": body.inertia.tolist(),
        "without_frame": _without_frame(scene),
        "effects": found,
        "outside": outside,
        "accept_first": ["unknown"] if outside and accept == ["none"] else accept,
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
    whole = scene.body
    mass = whole.mass - frame.mass
    center = (whole.mass * whole.center_of_mass - frame.mass * frame.center_of_mass) / mass
    about = _about_origin(whole) - _about_origin(Body(frame.mass, frame.center_of_mass, frame.inertia))
    inertia = about - mass * _steiner(center)
    return {"mass": mass, "center_of_mass": center.tolist(), "inertia": inertia.tolist()}


def _about_origin(body: Body) -> Any:
    return body.inertia + body.mass * _steiner(body.center_of_mass)


def _steiner(arm: Any) -> Any:
    return float(arm @ arm) * np.eye(3) - np.outer(arm, arm)


def add_point(body: Body, mass: float, position: Any) -> Body:
    """The body with a point mass fixed to it (a negative one takes it away)."""
    total = body.mass + mass
    center = (body.mass * body.center_of_mass + mass * position) / total
    about = _about_origin(body) + mass * _steiner(position)
    return Body(total, center, about - total * _steiner(center))


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
