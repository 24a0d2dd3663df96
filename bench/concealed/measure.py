"""From true motion to what the devices of the rig send: :class:`rig_identification.recording.Recording`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bench.concealed.effects.base import Effect
from bench.concealed.scene import Array, Plan, Scene
from bench.concealed.signals import Readings, Samples, Trajectory
from rig_identification.recording import Dummy, Recording, Series

# Device: (first sample after the recording's start, interval), in milliseconds.
SCHEDULE = {
    "exciter": (8, 2),
    "shaft": (11, 10),
    "imu": (14, 5),
    "inclinometer": (20, 50),
    "odometry": (2, 5),
}
CABLE_STAGGER, CABLE_INTERVAL = 8, 2
START_NS = 1_793_000_000_000_000_000
BETWEEN_RECORDINGS_NS = 300_000_000_000


def sense(trajectory: Trajectory, scene: Scene) -> Readings:
    """Readings of ideal sensors at their true places."""
    devices = scene.devices
    rotation = Rotation.from_quat(trajectory.quaternion).as_matrix()
    arm, rate, change = devices.imu_position, trajectory.rate, trajectory.rate_change
    gravity = np.array([0.0, 0.0, -scene.rig.gravity])
    specific = np.einsum("nji,nj->ni", rotation, trajectory.acceleration - gravity)
    specific = specific + np.cross(change, arm) + np.cross(rate, np.cross(rate, arm))
    axes_world = rotation @ devices.inclinometer_rotation
    return Readings(
        trajectory.time,
        trajectory.tension,
        trajectory.force,
        trajectory.shaft,
        rate @ devices.imu_rotation,
        specific @ devices.imu_rotation,
        np.arcsin(np.clip(axes_world[:, 2, :2], -1.0, 1.0)),
    )


def imperfect(readings: Readings, scene: Scene) -> Readings:
    """Readings with the sensors' gains and zeros."""
    e = scene.errors
    return replace(
        readings,
        tension=readings.tension * e.tension_gain + e.tension_zero,
        force=readings.force * e.force_gain,
        rate=readings.rate * (1.0 + e.rate_scale) + e.rate_bias,
        specific_force=readings.specific_force * (1.0 + e.acceleration_scale) + e.acceleration_bias,
        inclination=readings.inclination + e.inclination_zero,
    )


def device_samples(
    trajectory: Trajectory,
    scene: Scene,
    effects: Sequence[Effect],
    plan: Plan,
    index: int,
    noise: float = 1.0,
) -> dict[str, Samples]:
    """Samples by device: cable names, ``exciter``, ``shaft``, ``imu``, ``inclinometer``.

    ``noise`` scales the noise; the same scene and ``index`` always draw the same noise.
    """
    readings = sense(trajectory, scene)
    for effect in effects:
        readings = effect.distort(readings, scene, plan)
    readings = imperfect(readings, scene)
    std = scene.rig.noise
    wide = np.concatenate([np.full(3, std["angular_rate"]), np.full(3, std["specific_force"])])
    imu = np.concatenate([readings.rate, readings.specific_force], axis=1)
    table: dict[str, tuple[Array, Array, tuple[int, int], str]] = {}
    for i, name in enumerate(scene.geometry.names):
        schedule = (CABLE_STAGGER * i, CABLE_INTERVAL)
        table[name] = (readings.tension[:, i : i + 1], np.array([std["tension"]]), schedule, "tension")
    table["exciter"] = (readings.force, np.full(3, std["exciter_force"]), SCHEDULE["exciter"], "exciter")
    table["imu"] = (imu, wide, SCHEDULE["imu"], "imu")
    table["inclinometer"] = (
        readings.inclination,
        np.full(2, std["inclination"]),
        SCHEDULE["inclinometer"],
        "inclinometer",
    )
    table["shaft"] = (readings.shaft, np.zeros(2), SCHEDULE["shaft"], "exciter")
    out = {}
    for k, (device, (dense, spread, schedule, clock)) in enumerate(table.items()):
        rng = np.random.default_rng([scene.seed, 2, index, k])
        rows = _rows(readings.time, plan, schedule)
        values = dense[rows] + noise * spread * rng.normal(size=(len(rows), dense.shape[1]))
        samples = Samples(readings.time[rows] + scene.errors.clock.get(clock, 0.0), values)
        for effect in effects:
            samples = effect.corrupt(device, samples, scene, plan)
        out[device] = samples
    return out


def record(
    trajectory: Trajectory,
    scene: Scene,
    effects: Sequence[Effect],
    plan: Plan,
    index: int,
    with_shaft: bool,
) -> Recording:
    """One recording, as if read from its bag."""
    samples = device_samples(trajectory, scene, effects, plan, index)
    odometry = _odometry(trajectory, plan)
    first = min(s.time[0] for s in (*samples.values(), odometry))
    last = max(s.time[-1] for s in (*samples.values(), odometry))
    series = {d: Series(np.round(s.time - first, 9), s.values) for d, s in samples.items()}
    dummy = Dummy(plan.dummy_mass, plan.dummy_position) if plan.dummy_mass > 0.0 else None
    start = START_NS + (scene.seed % 100_000) * 1_000_000_000 + index * BETWEEN_RECORDINGS_NS
    return Recording(
        name=plan.name,
        kind=plan.kind,
        holdout=plan.holdout,
        start_ns=start,
        duration=float(last - first),
        dummy=dummy,
        tension={name: series[name] for name in scene.geometry.names},
        exciter_force=series["exciter"],
        exciter_shaft=series["shaft"] if with_shaft and plan.motor is not None else None,
        imu=series["imu"],
        inclination=series["inclinometer"],
        ground_truth=Series(np.round(odometry.time - first, 9), odometry.values),
    )


def _rows(time: Array, plan: Plan, schedule: tuple[int, int]) -> NDArray[np.int_]:
    offset, interval = schedule
    begin = round(1000.0 * plan.first_sample) + offset
    return np.arange(begin, len(time), interval)


def _odometry(trajectory: Trajectory, plan: Plan) -> Samples:
    rows = _rows(trajectory.time, plan, SCHEDULE["odometry"])
    to_body = Rotation.from_quat(trajectory.quaternion[rows]).inv()
    velocity = to_body.apply(trajectory.velocity[rows])
    values = np.concatenate(
        [trajectory.position[rows], trajectory.quaternion[rows], velocity, trajectory.rate[rows]], axis=1
    )
    return Samples(trajectory.time[rows], values)
