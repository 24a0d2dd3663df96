"""Physics of small bodies on threads, which a watched pendulum shows and a rig of steel does not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.observability import believed_point
from rig_identification.estimate.parameters import INERTIAL, Parameter
from rig_identification.estimate.rolling import line_of_hinges
from rig_identification.estimate.solve import Evaluation, Point, Problem
from rig_identification.mismatch.candidate import Candidate, Told, added
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import RigModel
from rig_identification.result import ELEMENTS
from rig_identification.rig import Rig


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
        *(_bending(block, k, 0.1 * mass * length * speed / (2 * n)) for k in range(2)),
        *(_plates(block, size, k) for k in range(2)),
        Candidate(
            "unknown",
            (
                added(
                    "turning.cube",
                    "N*m",
                    mass * rig.gravity * (0.5 * size) ** 2 / length,
                    block + place.TURNING_CUBE,
                ),
            ),
            "What turns the body back about the vertical does not grow in proportion: a moment of {value} "
            "times the cube of the turn's sine comes besides (negative: wide turns are slower than small). "
            "Air that goes along with wide turns does that, or hinges that slip.",
            "For the inertia about the vertical use small turns; a plate of known size hung beside tells air "
            "from hinges.",
            {"channel": None, "axis": "z", "law": "turn that softens"},
            name_in_result="cubic_moment",
        ),
    ]
    line = line_of_hinges(rig)
    out += [_held_end(rig, mass, i, () if line is None else hidden_by_roll(line)) for i in range(n)]
    return out if line is None else [*out, _rolling(rig, mass, size, line)]


def _bending(block: int, k: int, std: float) -> Candidate:
    """Hinges at the ceiling (``k`` 0) or at the body that damp as they bend and twist freely."""
    end = ("ceiling", "body")[k]
    return Candidate(
        "hinge_damping",
        (added(f"hinge.bending_{end}", "N*m*s/rad", std, block + place.BENDING + k),),
        f"The cables' hinges at the {end} damp the motion as they bend, and twist freely: each puts "
        "{value} against the rate at which it bends.",
        "Use knife edges or ball joints, or keep the damping in the model.",
        {"channel": None, "axis": None, "end": end},
        positive=1,
        name_in_result="damping",
    )


def _held_end(rig: Rig, mass: float, i: int, hides: tuple[str, ...]) -> Candidate:
    """The upper end of cable ``i`` holds it as it leans, or goes along (effects/held_ends.py)."""
    name, n = rig.cables[i].name, len(rig.cables)
    std = LOOP * mass * rig.gravity / n * rig.cables[i].length
    first = layout.cable_offset(i) + layout.LEAN
    lean = tuple(
        added(f"{name}.held_{axes}", "N*m/rad", std, first + k) for k, axes in enumerate(("xx", "xy", "yy"))
    )

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        physics = model.physics.copy()
        physics[layout.effects_offset(n) + place.LEANING] = 1.0
        return model.with_physics(physics), lean

    def told(found: Estimates) -> Told:
        """Stiffness along the axis of the two that is held or yields most, that axis, and the other."""
        names = [p.name for p in lean]
        return {
            "stiffness": (*found.following(_largest, *names), "N*m/rad"),
            "stiffness_across": (*found.following(_smallest, *names), "N*m/rad"),
            "azimuth": (*found.following(_azimuth, *names), "rad"),
        }

    return Candidate(
        "unknown",
        lean,
        f"The upper end of {name} is no point: it holds the cable with {{value}} as it leans towards "
        "azimuth {told[azimuth]} in the world, and with {told[stiffness_across]} across that (negative: it "
        "goes along), as a loop round a beam, a clamp or a support that gives way does.",
        "Hang the cables on single points: a small shackle, a ball joint. Measure their lengths from there.",
        {"channel": name, "axis": None, "end": "ceiling", "law": "held end"},
        tell=told,
        build=build,
        hides=hides,
    )


def _largest(xx: float, xy: float, yy: float) -> float:
    """The larger principal value of a symmetric matrix."""
    return 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)


def _smallest(xx: float, xy: float, yy: float) -> float:
    """The smaller one."""
    return 0.5 * (xx + yy) - math.hypot(0.5 * (xx - yy), xy)


def _azimuth(xx: float, xy: float, yy: float) -> float:
    """Angle (rad) of the larger one's axis from x."""
    return 0.5 * math.atan2(2.0 * xy, xx - yy)


def _plates(block: int, size: float, face: int) -> Candidate:
    """Air against the sides of a body that face along x (``face`` 0) or y, at the hinges' distance."""
    axis, reach = "xy"[face], 0.5 * size
    plates = added(f"air.plates_{axis}", "m^2", 3.0 * size**2, block + place.PLATES + face)

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        physics = model.physics.copy()
        physics[block + place.PLATE_REACH] = reach
        return model.with_physics(physics), (plates,)

    def told(found: Estimates) -> Told:
        return {
            "drag_area": (*found.of(plates.name), "m^2"),
            "turning_drag": (*found.following(lambda area: area * reach**3, plates.name), "m^5"),
        }

    return Candidate(
        "air_drag",
        (plates,),
        f"The air resists the sides of the body that face its {axis} axis, as plates of Cd A = {{value}} "
        "do at the outermost hinges' distance: against turning, and against swinging the more the "
        "faster it turns.",
        "Turn it slowly, or keep the drag in the model.",
        {"channel": None, "axis": axis},
        positive=1,
        tell=told,
        build=build,
    )


def _as_hinges(found: Estimates) -> Told:
    """Hinges that hold against rolling: how stiffly, and how far off the line of hinges their axis is."""
    return {
        "roll_stiffness": (*found.of("hinge.roll_stiffness"), "N*m/rad"),
        "axis_angle": (*found.following(math.atan, "hinge.roll_skew"), "rad"),
    }


#: Height of the loop in which a cable may end, as a share of its length: std of what an upper end holds with.
LOOP = 0.1
#: Std of the angle (rad) between the line of hinges and the axis about which they hold: bridles tied by hand.
SKEW = 0.3
#: Share of a body axis in the line of the hinges above which its elements have to do with rolling about it.
ALONG = 0.1


def hidden_by_roll(line: np.ndarray) -> tuple[str, ...]:
    """Elements that only rolling about a ``line`` (3,) tells.

    Rolling shows stiffness, depth of the centre of mass and inertia about the line together. Another law of
    the same stiffness, which nothing here tells from this one, makes another body of them.
    """
    about = {"xyz"[i] for i in range(3) if abs(line[i]) > ALONG}
    return tuple(name for name in ELEMENTS if name == "cz" or (name[0] == "J" and about & set(name[1:])))


def _rolling(rig: Rig, mass: float, size: float, line: np.ndarray) -> Candidate:
    """Hinges that hold the body against rolling about their ``line``: no word of the contract fits."""
    block = layout.effects_offset(len(rig.cables))
    axis = block + place.ROLL_AXIS
    roll = added("hinge.roll_stiffness", "N*m/rad", mass * rig.gravity * size, block + place.ROLL_STIFFNESS)
    skew = added("hinge.roll_skew", "1", SKEW, block + place.ROLL_SKEW)
    height = float(np.mean([c.body_point[2] for c in rig.cables]))

    def build(model: RigModel) -> tuple[RigModel, tuple[Parameter, ...]]:
        physics = model.physics.copy()
        physics[axis : axis + 3] = line
        return model.with_physics(physics), (roll, skew)

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
        (roll, skew),
        "The body is not free to roll about the line of its hinges: a moment of {value} holds it against the "
        "mean direction of its cables, as a bridle, a loop round a bar or a stiff knot does. What such "
        "hinges do to the turning about the vertical cannot be told from inertia, and is left out.",
        "Hang the body on single points, or keep the stiffness in the model.",
        {"channel": None, "axis": None, "end": "body", "law": "hold against rolling"},
        positive=1,
        tell=_as_hinges,
        build=build,
        settle=settle,
        hides=hidden_by_roll(line),
    )
