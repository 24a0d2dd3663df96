"""Physics of small bodies on threads, which a watched pendulum shows and a rig of steel does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.launch import launch_state
from rig_identification.estimate.observability import believed_point
from rig_identification.estimate.parameters import INERTIAL, Parameter
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
        Candidate(
            "hinge_damping",
            (
                added(
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
            (added("air.turning", "m^5", 3.0 * size**2 * (0.5 * size) ** 3, block + place.TURNING_DRAG),),
            "The air resists the body's turning with the square of its rate, as a plate of Cd A = {value} "
            "does that stands across its way at the outermost hinges' distance.",
            "Turn it slowly, or keep the drag in the model.",
            {"channel": None, "axis": None},
            positive=1,
            tell=_as_plate(0.5 * size),
        ),
    ]
    line = _line_of_hinges(rig)
    return out if line is None else [*out, _rolling(rig, mass, size, line)]


def _as_plate(distance: float) -> Callable[[dict[str, float], dict[str, float]], Told]:
    """What resists turning, as the drag area of a plate at a ``distance`` (m) from the axis, and as it is."""

    def told(values: dict[str, float], stds: dict[str, float]) -> Told:
        value, std = values["air.turning"], stds["air.turning"]
        return {
            "drag_area": (value / distance**3, std / distance**3, "m^2"),
            "turning_drag": (value, std, "m^5"),
        }

    return told


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
        hides=hidden_by_roll(line),
    )


def _line_of_hinges(rig: Rig) -> np.ndarray | None:
    """(3,) direction of the line that all body hinges lie on; None where they span a plane."""
    points = np.array([c.body_point for c in rig.cables])
    _, sizes, axes = np.linalg.svd(points - np.mean(points, axis=0))
    return None if sizes[0] <= 0.0 or sizes[1] > 1e-2 * sizes[0] else np.asarray(axes[0])
