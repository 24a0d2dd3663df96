"""Physics that the ideal model leaves out: one entry for each file of model/effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.observability import believed_point
from rig_identification.estimate.parameters import AXES, INERTIAL, Parameter, ParameterSet
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.mismatch.candidate import Candidate, Told
from rig_identification.model import layout
from rig_identification.model.body import (
    can_exist,
    elements_from_linear,
    linear_from_log_cholesky,
    log_cholesky_from_linear,
    point_inertia,
    six_elements,
)
from rig_identification.model.effects import place
from rig_identification.model.motion import RigModel
from rig_identification.rig import Rig

#: Length (m) of a hose that pulls as hard as any would and resists sideways most.
SHORT_HOSE = 1.0


def _added(name: str, unit: str, std: float, entry: int, nominal: float = 0.0) -> Parameter:
    return Parameter(name, unit, nominal, std, "physics", entry, bounded=False)


def _tether(
    axes: str, block: int, mass: float, gravity: float, length: float, size: float, middle: np.ndarray
) -> Candidate:
    """A tether that pulls along ``axes``: along one as a taut hose does, along all as one that hangs.

    What is taut resists sideways as well, by its pull over its length F0/l alike to both sides: too little to
    show by itself, and enough to stand for a centre of mass that lies millimetres higher.
    """
    spring, pull = 0.2 * mass * gravity / length, 0.02 * mass * gravity
    parts = [
        _added(f"tether.{what}.{a}", unit, std, block + entry + AXES.index(a))
        for what, unit, std, entry in (
            ("stiffness", "N/m", spring, place.TETHER_STIFFNESS),
            ("pull", "N", pull, place.TETHER_PULL),
        )
        for a in axes
    ]
    if len(axes) == 1:
        first, second = (block + place.TETHER_STIFFNESS + i for i, a in enumerate(AXES) if a != axes)
        aside = _added("tether.sideways", "N/m", pull / SHORT_HOSE, first)
        parts.append(replace(aside, also=(second,)))
    parts += [
        _added(f"tether.point.{a}", "m", size, block + place.TETHER_POINT + i, float(middle[i]))
        for i, a in enumerate(AXES)
    ]

    def told(values: dict[str, float], stds: dict[str, float]) -> Told:
        stiff = {a: values[f"tether.stiffness.{a}"] for a in axes}
        main = max(stiff, key=lambda a: abs(stiff[a]))
        out: Told = {"stiffness": (stiff[main], stds[f"tether.stiffness.{main}"], "N/m")}
        for p in parts:
            _, what, *a = p.name.split(".")
            if what == "point" or len(axes) > 1:
                out["_".join([what, *a])] = (values[p.name], stds[p.name], p.unit)
            elif what == "pull":
                out["preload"] = (abs(values[p.name]), stds[p.name], p.unit)
        return out

    return Candidate(
        "tether",
        tuple(parts),
        "A hose or wire pulls on the body with a stiffness of {value}.",
        "Let cables and hoses hang free in a long loop, or take them off.",
        {"channel": None, "axis": axes if len(axes) == 1 else None},
        positive=len(axes),
        tell=told,
    )


def physics_of_pendulums(rig: Rig, mass: float) -> list[Candidate]:
    """What small bodies on threads show besides. mass: kg, roughly.

    Hinges that are no joints: knots, bridles and clamped wires; and the air that a turning body stirs.
    """
    n = len(rig.cables)
    block = layout.effects_offset(n)
    length = float(np.mean([c.length for c in rig.cables]))
    size = float(np.max(extent(rig)))
    speed = np.sqrt(rig.gravity * length)
    out = [
        Candidate(
            "hinge_damping",
            (
                _added(
                    "hinge.bending", "N*m*s/rad", 0.1 * mass * length * speed / (2 * n), block + place.BENDING
                ),
            ),
            "The cables' hinges damp the motion as they bend, and twist freely: each puts {value} against "
            "the rate at which it bends.",
            "Use knife edges or ball joints, or keep the damping in the model.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="damping",
        ),
        Candidate(
            "air_drag",
            (_added("air.turning", "m^5", 3.0 * size**2 * (0.5 * size) ** 3, block + place.TURNING_DRAG),),
            "The air resists the body's turning with the square of its rate: Cd A r^3 = {value}, for a plate "
            "of area A at distance r.",
            "Turn it slowly, or keep the drag in the model.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="turning_drag",
        ),
    ]
    line = _line_of_hinges(rig)
    return out if line is None else [*out, _rolling(rig, mass, size, line)]


def _rolling(rig: Rig, mass: float, size: float, line: np.ndarray) -> Candidate:
    """Hinges that hold the body against rolling about their ``line``: no word of the contract fits."""
    block = layout.effects_offset(len(rig.cables))
    axis = block + place.ROLL_AXIS
    roll = _added("hinge.roll_stiffness", "N*m/rad", mass * rig.gravity * size, block + place.ROLL_STIFFNESS)
    height = float(np.mean([c.body_point[2] for c in rig.cables]))

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        physics = model.physics.copy()
        physics[axis : axis + 3] = line
        return model.with_physics(physics), (roll,)

    def settle(problem: Problem, point: Point, evaluation: Evaluation) -> Point:
        """A body that such hinges alone keep upright: a fit without them holds it far below the hinges."""
        parameters = problem.bench.parameters
        theta = believed_point(problem, replace(evaluation, point=point))
        elements = parameters.elements(theta)
        elements[3] = height + 0.1 * size
        theta = np.concatenate([parameters.start(elements)[:INERTIAL], point.theta[INERTIAL:]])
        theta[parameters.index_of(roll.name)] = 0.5
        starts = tuple(
            launch_state(problem.bench, run, theta, start)
            for run, start in zip(problem.runs, point.starts, strict=True)
        )
        return replace(point, theta=theta, starts=starts)

    return Candidate(
        "unknown",
        (roll,),
        "The body is not free to roll about the line of its hinges: a moment of {value} holds it against the "
        "mean direction of its cables, as a bridle, a loop round a bar or a stiff knot does. What such "
        "hinges do to the turning about the vertical cannot be told from inertia, and is left out.",
        "Hang the body on single points, or keep the stiffness in the model.",
        {"channel": None, "axis": None, "end": "body"},
        positive=1,
        name_in_result="roll_stiffness",
        build=build,
        settle=settle,
    )


def _line_of_hinges(rig: Rig) -> np.ndarray | None:
    """(3,) direction of the line that all body hinges lie on; None where they span a plane."""
    points = np.array([c.body_point for c in rig.cables])
    _, sizes, axes = np.linalg.svd(points - np.mean(points, axis=0))
    return None if sizes[0] <= 0.0 or sizes[1] > 1e-2 * sizes[0] else np.asarray(axes[0])


def left_out_physics(rig: Rig, parameters: ParameterSet, mass: float) -> list[Candidate]:
    """Every effect on the motion, with priors scaled to this rig and body.

    mass: kg, roughly. A prior's std is what such rigs can plausibly show: a tenth of
    critical damping, friction of a dry bearing of a centimetre's radius, a body's frontal
    area, percents of its mass.
    """
    n = len(rig.cables)
    block = layout.effects_offset(n)
    length = float(np.mean([c.length for c in rig.cables]))
    size = float(np.max(extent(rig)))
    speed = np.sqrt(rig.gravity * length)
    middle = np.mean([c.body_point for c in rig.cables], axis=0) - [0.0, 0.0, 0.3 * size]
    out = [
        Candidate(
            "hinge_damping",
            (
                _added(
                    "hinge.damping", "N*m*s/rad", 0.1 * mass * length * speed / (2 * n), block + place.DAMPING
                ),
            ),
            "The cables' hinges damp the motion: each puts {value} against the rate at which it turns.",
            "Use knife edges or ball joints, or keep the damping in the model.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="damping",
        ),
        Candidate(
            "hinge_friction",
            (_added("hinge.friction", "N*m", 0.003 * mass * rig.gravity / n, block + place.FRICTION),),
            "The cables' hinges rub: each holds against turning with {value}.",
            "Grease or replace the hinges; dry friction spoils small motions most.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="torque",
        ),
        Candidate(
            "air_drag",
            (_added("air.drag_area", "m^2", 3.0 * size**2, block + place.DRAG_AREA),),
            "The air resists with the square of speed: a drag area of {value}.",
            "Keep speeds low, or keep the drag in the model.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="drag_area",
        ),
        Candidate(
            "air_added_mass",
            (_added("air.added_mass", "kg", 0.02 * mass, block + place.ADDED_MASS),),
            "Air that moves with the body adds {value} to its inertia but not to its weight.",
            "Motion alone cannot tell entrained air from inertia: it shows against scale and statics.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="added_mass",
        ),
        Candidate(
            "cable_mass",
            (_added("cable.linear_density", "kg/m", 0.002 * mass / n, block + place.LINEAR_DENSITY),),
            "The cables weigh {value}.",
            "Weigh a length of the cable and enter it.",
            {"channel": None, "axis": None},
            positive=1,
            name_in_result="linear_density",
        ),
        *(_tether(axes, block, mass, rig.gravity, length, size, middle) for axes in (*AXES, AXES)),
    ]
    if rig.exciter is not None:
        out.append(
            Candidate(
                "exciter_rotor",
                (_added("exciter.rotor_mass", "kg", 0.03 * mass, block + place.ROTOR_MASS),),
                "The exciter's moving mass of {value} rides on the body, unweighed.",
                "Weigh the motor with its unbalance and add it to the body.",
                {"channel": "exciter", "axis": None},
                positive=1,
                name_in_result="rotor_mass",
                settle=_less_the_rotor,
            )
        )
    if parameters.model.physics[block + place.GYROSCOPIC_SHARE] != 0.0:
        out.append(_gyroscopic_term(block, float(parameters.model.physics[block + place.GYROSCOPIC_SHARE])))
    return out


def _less_the_rotor(problem: Problem, point: Point, evaluation: Evaluation) -> Point:
    """The body without the rotor that a fit without one holds in it: together they move as that fit does."""
    _ = evaluation
    parameters = problem.bench.parameters
    values = dict(zip((p.name for p in parameters.free), parameters.values(point.theta), strict=True))
    mass, at = values["exciter.rotor_mass"], layout.EXCITER_POSITION
    mount = parameters.physics(point.theta)[at : at + 3]
    rotor = np.array([mass, *(mass * mount), *six_elements(point_inertia(mass, mount))])
    alone = linear_from_log_cholesky(point.theta[:INERTIAL]) - rotor
    if not can_exist(elements_from_linear(alone)):
        return point
    return replace(point, theta=np.concatenate([log_cholesky_from_linear(alone), point.theta[INERTIAL:]]))


def _gyroscopic_term(block: int, lacking: float) -> Candidate:
    """The gyroscopic moment, where the ideal model lacks a share of it: in nature none is missing."""
    share = _added("gyroscopic_share", "1", 1.0, block + place.GYROSCOPIC_SHARE, lacking)

    def told(values: dict[str, float], stds: dict[str, float]) -> Told:
        return {"share": (1.0 - values[share.name], stds[share.name], "1")}

    return Candidate(
        "gyroscopic_term",
        (share,),
        "The body's own rotation turns its angular momentum: {value} of the moment w x (J w) acts.",
        "Keep the gyroscopic term in the equations.",
        {"channel": None, "axis": None},
        tell=told,
    )
