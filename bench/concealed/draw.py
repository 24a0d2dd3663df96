"""Random scenes: rig, body, mounts, ordinary errors and the plan of the recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from bench.concealed.scene import Array, Body, Devices, Geometry, Motor, Plan, Scene, SensorErrors
from rig_identification.rig import DEFAULT_TOLERANCE, Cable, CarryingFrame, Mount, Rig

GRAVITY = 9.80665
NOISE = {
    "tension": 2.0,
    "exciter_force": 0.5,
    "specific_force": 0.01,
    "angular_rate": 0.0003,
    "inclination": 0.0003,
}

# Ceiling rectangle, body rectangle, first hinge in world, centre of mass from the first hinge, mass,
# inertia xx yy zz yz: the thesis' cases 1, 10, 12 and 14.
CASES = {
    "case_1": ((4.0, 5.0), (2.0, 3.0), (1.0, 1.0, -2.0616), (1.0, 1.5, -0.5), 250.0, (520, 310, 640, 20)),
    "case_10": (
        (4.0, 7.75),
        (2.0, 5.0),
        (0.985, 1.375, -1.437),
        (0.985, 1.375, -1.437),
        1975.0,
        (3741, 963, 3973, 168),
    ),
    "case_12": (
        (3.5, 5.0),
        (1.5, 2.5),
        (0.7, 1.0325, -1.126),
        (0.7, 1.0325, -1.126),
        880.0,
        (987, 274, 1102, 32),
    ),
    "case_14": (
        (4.0, 6.0),
        (1.6, 2.8),
        (0.8, 1.128, -1.137),
        (0.8, 1.128, -1.137),
        1145.0,
        (1617, 365, 1785, 70),
    ),
}
TRIANGLES = ("trifilar", "splayed_3")
GEOMETRIES = (*CASES, *TRIANGLES)
#: Tolerances beyond which an error is a finding (recording contract).
FINDING = 3.0


def draw_scene(seed: int, duration: float) -> Scene:
    """A clean scene: description right within the default tolerances, nothing left out."""
    rng = np.random.default_rng([seed, 1])
    name = str(rng.choice(GEOMETRIES))
    geometry, body = draw_rig(rng, name)
    return assemble(rng, seed, name, geometry, body, duration, held=len(geometry.length) == 4)


def draw_rig(rng: np.random.Generator, name: str) -> tuple[Geometry, Body]:
    """Hinges, cables and body of one of :data:`GEOMETRIES`."""
    return _four_cables(rng, name) if name in CASES else _three_cables(rng, name)


def assemble(
    rng: np.random.Generator,
    seed: int,
    name: str,
    geometry: Geometry,
    body: Body,
    duration: float,
    held: bool,
) -> Scene:
    """A scene about a rig: devices, ordinary errors, description and plans.

    ``held``: splayed cables leave the body two degrees of freedom or less; the runs pull harder.
    """
    devices = _draw_devices(rng, geometry, body)
    errors = _draw_errors(rng, len(geometry.length))
    rig = _describe(rng, geometry, body, devices)
    plans = _draw_plans(rng, body, geometry, duration, held)
    level = np.array([*_normal(rng, DEFAULT_TOLERANCE["level"], 2), 0.0])
    geometry = replace(geometry, ceiling=Rotation.from_rotvec(level).apply(geometry.ceiling))
    return Scene(seed, name, rig, body, geometry, devices, errors, level, plans)


def scaled(plan: Plan, share: float) -> Plan:
    """The same run with ``share`` of its force and of its displacement; released aside, not from level."""
    if plan.motor is None:
        return plan
    return replace(
        plan,
        start="pull" if plan.start == "thesis" else plan.start,
        pull=share * plan.pull,
        motor=replace(plan.motor, unbalance=share * plan.motor.unbalance),
    )


def _four_cables(rng: np.random.Generator, name: str) -> tuple[Geometry, Body]:
    ceiling_size, body_size, first, center, mass, inertia = CASES[name]
    splay = rng.uniform(0.9, 1.1, 2)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=float)
    hinge = corners * [*body_size, 0.0] + rng.normal(0.0, 0.01, (4, 3))
    ceiling = (corners - [0.5, 0.5, 0.0]) * [ceiling_size[0] * splay[0], ceiling_size[1] * splay[1], 0.0]
    ceiling = ceiling + np.array([*ceiling_size, 0.0]) / 2.0 + rng.normal(0.0, 0.01, (4, 3))
    # Lengths such that the level pose of the thesis fits: it is a start that the cables allow.
    length = np.linalg.norm(np.array(first) + hinge - ceiling, axis=1)
    cells = tuple(str(rng.choice(["ceiling", "body"], p=[0.8, 0.2])) for _ in range(4))
    return Geometry(ceiling, hinge, length, cells), draw_body(rng, mass, np.array(center), inertia)


def _three_cables(rng: np.random.Generator, name: str) -> tuple[Geometry, Body]:
    hinge = np.array([[0.0, 0.0, 0.0], [2.0, 0.07, 0.0], [0.9, 2.99, 0.0]]) + rng.normal(0.0, 0.02, (3, 3))
    middle = hinge.mean(axis=0)
    if name == "trifilar":
        spread, drop = rng.uniform(0.98, 1.02), rng.uniform(2.5, 3.5)
    else:
        spread, drop = rng.uniform(1.25, 1.8), rng.uniform(1.6, 2.6)
    ceiling = middle + spread * (hinge - middle) + [0.0, 0.0, drop]
    ceiling[:, 2] = drop + rng.normal(0.0, 0.005, 3)
    length = np.linalg.norm(hinge - ceiling, axis=1)
    shift = ceiling[0].copy()  # world's origin is the first ceiling point
    cells = tuple(str(rng.choice(["ceiling", "body"], p=[0.8, 0.2])) for _ in range(3))
    center = np.array([middle[0], middle[1], rng.uniform(-1.2, -0.5)])
    body = draw_body(rng, rng.uniform(850.0, 1400.0), center, (1550, 450, 1600, 50))
    return Geometry(ceiling - shift, hinge, length, cells), body


def draw_body(rng: np.random.Generator, mass: float, center: Array, inertia: tuple[float, ...]) -> Body:
    mass = mass * rng.uniform(0.85, 1.15)
    xx, yy, zz, yz = inertia
    scale = rng.uniform(0.88, 1.12, 3)
    tensor = np.diag([xx * scale[0], yy * scale[1], zz * scale[2]]).astype(float)
    xz = rng.normal(0.0, 0.02 * np.sqrt(xx * zz))
    products = {(0, 1): rng.normal(0.0, 0.01 * xx), (0, 2): xz, (1, 2): yz * rng.uniform(0.3, 1.3)}
    for (a, b), value in products.items():
        tensor[a, b] = tensor[b, a] = value
    principal = np.linalg.eigvalsh(tensor)
    if principal[0] <= 0.0 or principal[0] + principal[1] < 1.02 * principal[2]:
        tensor += (1.04 * principal[2] - principal[0] - principal[1]) * np.eye(3)
    return Body(mass, center + rng.normal(0.0, [0.04, 0.05, 0.04]), tensor)


def _draw_devices(rng: np.random.Generator, geometry: Geometry, body: Body) -> Devices:
    span = geometry.hinge[:, :2].max(axis=0)
    imu = np.array([*rng.uniform(0.2, 0.8, 2) * span, rng.uniform(-0.8, -0.2)])
    imu_turn = Rotation.from_euler("z", rng.choice([0.0, 90.0, -90.0, 180.0]), degrees=True)
    exciter_turn = Rotation.from_euler("zy", [rng.uniform(0.0, 60.0), rng.uniform(0.0, 45.0)], degrees=True)
    small = Rotation.from_rotvec
    exciter = np.array([0.0, 0.0, 1.35 * body.center_of_mass[2]]) + rng.normal(0.0, 0.05, 3)
    return Devices(
        imu,
        (imu_turn * small(rng.normal(0.0, 0.001, 3))).as_matrix(),
        small(rng.normal(0.0, 0.0003, 3)).as_matrix(),
        exciter,
        exciter_turn.as_matrix(),
    )


def _draw_errors(rng: np.random.Generator, cables: int) -> SensorErrors:
    t = DEFAULT_TOLERANCE
    return SensorErrors(
        tension_gain=1.0 + _normal(rng, t["load_cell_gain"], cables),
        tension_zero=_normal(rng, t["load_cell_zero"], cables),
        force_gain=1.0 + float(_normal(rng, t["exciter_gain"], 1)[0]),
        acceleration_scale=_normal(rng, t["accelerometer_scale"], 3),
        acceleration_bias=_normal(rng, t["accelerometer_bias"], 3),
        rate_scale=_normal(rng, t["gyroscope_scale"], 3),
        rate_bias=_normal(rng, t["gyroscope_bias"], 3),
        inclination_zero=np.zeros(2),
        clock={d: float(_normal(rng, t["clock"], 1)[0]) for d in ("imu", "inclinometer")},
    )


def _describe(rng: np.random.Generator, geometry: Geometry, body: Body, devices: Devices) -> Rig:
    """What the lab believes: the truth within the default tolerances."""
    t = DEFAULT_TOLERANCE
    cables = []
    for i, name in enumerate(geometry.names):
        cables.append(
            Cable(
                name,
                _rounded(geometry.ceiling[i] + _normal(rng, t["hinge_position"], 3)),
                _rounded(geometry.hinge[i] + _normal(rng, t["hinge_position"], 3)),
                float(_rounded(geometry.length[i] + _normal(rng, t["cable_length"], 1))[0]),
                geometry.load_cell[i],
            )
        )
    frame = None
    if rng.random() < 0.5:
        share = 0.15 * body.inertia * rng.uniform(0.6, 1.0)
        center = np.round(body.center_of_mass + np.array([0.05, 0.1, 0.25]), 2)
        frame = CarryingFrame(float(np.round(0.14 * body.mass)), center, np.diag(np.round(np.diag(share))))
    return Rig(
        gravity=GRAVITY,
        cables=tuple(cables),
        mass=float(np.round(body.mass + rng.normal(0.0, 0.5), 1)),
        mass_std=0.5,
        frame=frame,
        imu=_mount(rng, devices.imu_position, devices.imu_rotation, t["imu_position"], t["imu_orientation"]),
        inclinometer=_mount(
            rng, np.zeros(3), devices.inclinometer_rotation, 0.0, t["inclinometer_orientation"]
        ),
        exciter=_mount(
            rng,
            devices.exciter_position,
            devices.exciter_rotation,
            t["exciter_position"],
            t["exciter_orientation"],
        ),
        noise=dict(NOISE),
        tolerance=dict(t),
    )


def _mount(rng: np.random.Generator, position: Array, rotation: Array, far: float, turned: float) -> Mount:
    believed = Rotation.from_matrix(rotation) * Rotation.from_rotvec(_normal(rng, turned, 3))
    return Mount(_rounded(position + _normal(rng, far, 3)), believed.as_quat())


def _draw_plans(
    rng: np.random.Generator, body: Body, geometry: Geometry, duration: float, splayed: bool
) -> tuple[Plan, ...]:
    dummy = np.round([*rng.uniform(0.1, 0.9, 2) * geometry.hinge[:, :2].max(axis=0), -0.25], 3)
    dummy_mass = float(np.round(0.045 * body.mass))
    first = "thesis" if splayed and rng.random() < 0.4 else "pull"
    plans = [
        Plan("static_bare", "static", 10.0),
        Plan("static_dummy", "static", 10.0, dummy_mass=dummy_mass, dummy_position=dummy),
    ]
    for name, start, share in (("run_1", first, 1.0), ("run_2", "pull2", 0.7)):
        # Four splayed cables hold the body harder than three: the same motion needs more pull.
        pull = share * (rng.uniform(0.05, 0.1) if splayed else rng.uniform(0.03, 0.06))
        heading = rng.uniform(0.0, 2.0 * np.pi)
        plans.append(
            Plan(
                name,
                "dynamic",
                duration,
                holdout=name == "run_2",
                start=start,
                pull=pull * body.mass * GRAVITY * np.array([np.cos(heading), np.sin(heading), 0.0]),
                pull_point=body.center_of_mass + rng.normal(0.0, 0.4, 3),
                motor=_draw_motor(rng, share * body.mass * rng.uniform(0.08, 0.2)),
                first_sample=float(np.round(rng.uniform(0.005, 0.04), 3)),
            )
        )
    return tuple(plans)


def _draw_motor(rng: np.random.Generator, force: float) -> Motor:
    """A motor that gives ``force`` (N) at its set frequency."""
    frequency = float(np.round(rng.uniform(0.75, 2.1), 2))
    return Motor(
        frequency=frequency,
        unbalance=force / (2.0 * np.pi * frequency) ** 2,
        ramp=rng.uniform(3.0, 6.0),
        wobble=rng.uniform(0.01, 0.04),
        wobble_period=rng.uniform(15.0, 30.0),
    )


def _normal(rng: np.random.Generator, std: float, count: int) -> Array:
    """(count,) ordinary errors: beyond three tolerances the contract calls one a finding, so none is.

    What lies beyond is drawn again by a generator of its own: all other draws of a seed stay as they are.
    """
    drawn = rng.normal(0.0, 1.0, count)
    again = rng.spawn(1)[0]
    while np.any(beyond := np.abs(drawn) > FINDING):
        drawn[beyond] = again.normal(0.0, 1.0, int(np.sum(beyond)))
    return drawn * std


def _rounded(values: Array) -> Array:
    return np.round(values, 7)
