"""A scene at another size: lengths, masses and times by the laws of a pendulum, descriptions likewise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.concealed.scene import Array, Body, Devices, Geometry, Motor, Plan, Scene
from rig_identification.rig import Cable, CarryingFrame, Mount, Rig

#: The small rig: 5 kg on strings of about 0.5 m.
LENGTH, MASS = 0.22, 0.005
#: Tolerances and noises that are lengths, and those that are forces.
_LENGTHS = ("cable_length", "hinge_position", "imu_position", "exciter_position")
_FORCES = ("load_cell_zero",)
_NOISE_FORCES = ("tension", "exciter_force")


def resized(scene: Scene, length: float = LENGTH, mass: float = MASS) -> Scene:
    """The scene with every length times ``length`` and every mass times ``mass``; gravity stays.

    Forces go with the mass, periods with the root of the length: tensions keep their share of the weight and
    specific forces stay as they are. Noises and tolerances of forces and lengths follow.
    """
    return replace(
        scene,
        geometry_name=f"small_{scene.geometry_name}",
        rig=_rig(scene.rig, length, mass),
        body=_body(scene.body, length, mass),
        geometry=_geometry(scene.geometry, length),
        devices=_devices(scene.devices, length),
        errors=replace(scene.errors, tension_zero=mass * scene.errors.tension_zero),
        plans=tuple(_plan(plan, length, mass) for plan in scene.plans),
    )


def _body(body: Body, length: float, mass: float) -> Body:
    return Body(mass * body.mass, length * body.center_of_mass, mass * length**2 * body.inertia)


def _geometry(geometry: Geometry, length: float) -> Geometry:
    return replace(
        geometry,
        ceiling=length * geometry.ceiling,
        hinge=length * geometry.hinge,
        length=length * geometry.length,
    )


def _devices(devices: Devices, length: float) -> Devices:
    return replace(
        devices,
        imu_position=length * devices.imu_position,
        exciter_position=length * devices.exciter_position,
    )


def _plan(plan: Plan, length: float, mass: float) -> Plan:
    return replace(
        plan,
        pull=mass * plan.pull,
        pull_point=length * plan.pull_point,
        motor=None if plan.motor is None else _motor(plan.motor, length, mass),
        dummy_mass=float(np.round(mass * plan.dummy_mass, 4)),
        dummy_position=_rounded(length * plan.dummy_position),
    )


def _motor(motor: Motor, length: float, mass: float) -> Motor:
    """Same share of the weight: force is unbalance times frequency squared, frequency as 1 / sqrt(length)."""
    return replace(
        motor, frequency=motor.frequency / np.sqrt(length), unbalance=mass * length * motor.unbalance
    )


def _rig(rig: Rig, length: float, mass: float) -> Rig:
    cables = tuple(
        Cable(
            c.name,
            _rounded(length * c.ceiling_point),
            _rounded(length * c.body_point),
            float(_rounded(length * np.array(c.length))),
            c.load_cell,
        )
        for c in rig.cables
    )
    frame = rig.frame
    if frame is not None:
        frame = CarryingFrame(
            mass * frame.mass, length * frame.center_of_mass, mass * length**2 * frame.inertia
        )
    tolerance = {**rig.tolerance, **{k: length * rig.tolerance[k] for k in _LENGTHS}}
    tolerance |= {k: mass * rig.tolerance[k] for k in _FORCES}
    return replace(
        rig,
        cables=cables,
        mass=None if rig.mass is None else mass * rig.mass,
        mass_std=None if rig.mass_std is None else mass * rig.mass_std,
        frame=frame,
        imu=_mount(rig.imu, length),
        exciter=_mount(rig.exciter, length),
        noise={**rig.noise, **{k: mass * rig.noise[k] for k in _NOISE_FORCES}},
        tolerance=tolerance,
    )


def _mount(mount: Mount | None, length: float) -> Mount | None:
    return None if mount is None else Mount(_rounded(length * mount.position), mount.orientation)


def _rounded(values: Array) -> Array:
    return np.round(values, 7)
