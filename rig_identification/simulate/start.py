"""How a run starts: hanging at rest, pulled aside and let go, or let go in a given pose or beside rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from rig_identification.errors import InputError
from rig_identification.model import layout
from rig_identification.model.equilibrium import design_pose, find_rest, settle
from rig_identification.model.motion import RigModel, State, on_cables

Array = NDArray[np.float64]

#: A given pose that misses the cables by more than this (m) is of another rig.
FURTHEST = 0.05
#: Part of a displacement that the cables have to leave of it: what keeps less is another motion.
LEAST_KEPT = 0.5
#: m: hinges that lie apart by less are in one place, as far as 64 bits tell of a room.
ROUNDING = 1e-9


@dataclass(frozen=True)
class AtRest:
    """The body hangs still."""


@dataclass(frozen=True)
class Pulled:
    """A constant force holds the body aside until time 0, then lets go."""

    force: Array  # (3,) N, world
    point: Array  # (3,) m, body


@dataclass(frozen=True)
class Posed:
    """The body is let go in a pose, moved to the nearest one that the cables allow."""

    position: Array  # (3,) m, body datum in world
    orientation: Array  # (4,) quaternion xyzw, rotates body vectors into world


@dataclass(frozen=True)
class Displaced:
    """The body is let go off its rest pose, in the nearest pose that the cables allow."""

    shift: Array  # (3,) m, of the centre of mass in world
    turn: Array  # (3,) rad, about world x, then y, then z, through the centre of mass


Start = AtRest | Pulled | Posed | Displaced


def rest_state(model: RigModel) -> State:
    """The rest pose that the body falls to from upright, to rounding.

    Raises InputError where it does not come to rest.
    """
    rest = find_rest(model, settle(model, design_pose(model)))
    if not rest.converged:
        raise InputError("simulation: the body finds no rest on these cables; check mass and hinge points")
    return rest.state


def start_state(model: RigModel, start: Start, rest: State) -> State:
    """State at time 0, velocities zero. rest: see :func:`rest_state`.

    Raises InputError where the cables do not allow the start.
    """
    if isinstance(start, AtRest):
        return rest
    if isinstance(start, Pulled):
        return _pulled_aside(model, start, rest)
    if isinstance(start, Displaced):
        return _displaced(model, start, rest)
    R = Rotation.from_quat(start.orientation).as_matrix()
    given = State(np.array(start.position, dtype=float), R, np.zeros(3), np.zeros(3))
    state = on_cables(model, given)
    moved = float(np.linalg.norm(state.position - given.position))
    if not moved < FURTHEST:
        raise InputError(
            f"start: the nearest pose on the cables is {moved:.3g} m away from the given one; check it"
        )
    return state


def _displaced(model: RigModel, start: Displaced, rest: State) -> State:
    """The pose on the cables whose hinges are nearest. Raises InputError where hardly any of it is left."""
    moment, mass = model.physics[layout.INERTIAL + 1 : layout.INERTIAL + 4], model.physics[layout.INERTIAL]
    center, hinges = moment / mass, _hinges(model)
    turn = Rotation.from_euler("xyz", start.turn) * Rotation.from_matrix(rest.R_world_body)
    middle = rest.position + rest.R_world_body @ center + start.shift
    asked = middle + turn.apply(hinges - center)
    resting = rest.position + hinges @ rest.R_world_body.T
    far = float(np.linalg.norm(asked - resting))
    if far < ROUNDING:
        return rest

    def missed(position: Array, turned: Rotation) -> float:
        return float(np.sum((position + turned.apply(hinges) - asked) ** 2)) / far**2

    state = _on_lengths(model, rest, missed)
    if state is not None:
        kept = np.linalg.norm(state.position + hinges @ state.R_world_body.T - resting)
        if kept >= LEAST_KEPT * far:
            return state
    raise InputError(
        "displaced: the cables hold the body against it, the nearest pose that they allow is near rest; "
        "displace it along a direction in which it swings"
    )


def _pulled_aside(model: RigModel, pull: Pulled, rest: State) -> State:
    """Least potential energy under the pull with every rigid cable at its length."""
    gravity, moment = model.physics[:3], model.physics[layout.INERTIAL + 1 : layout.INERTIAL + 4]
    mass = model.physics[layout.INERTIAL]
    weight = mass * float(np.linalg.norm(gravity))

    def energy(position: Array, turn: Rotation) -> float:
        fallen = gravity @ (mass * position + turn.apply(moment))
        return -float((fallen + pull.force @ (position + turn.apply(pull.point))) / weight)

    state = _on_lengths(model, rest, energy)
    if state is None:
        size = float(np.linalg.norm(pull.force))
        raise InputError(f"start: no pose holds against a pull of {size:.4g} N; pull less")
    return state


def _hinges(model: RigModel) -> Array:
    """(n, 3) m, on the body."""
    places = [layout.cable_offset(i) + layout.BODY_POINT for i in range(model.cables)]
    return np.array([model.physics[p : p + 3] for p in places])


def _on_lengths(model: RigModel, rest: State, objective: Callable[[Array, Rotation], float]) -> State | None:
    """The state near rest at which an objective of the pose is least with every cable at its length.

    None where there is no such pose.
    """
    physics = model.physics
    offsets = [layout.cable_offset(i) for i in range(model.cables)]
    ceiling = np.array([physics[o + layout.CEILING_POINT : o + layout.CEILING_POINT + 3] for o in offsets])
    hinges = _hinges(model)
    lengths = np.array([physics[o + layout.LENGTH] for o in offsets])
    if model.internal or np.any(model.modes != layout.RIGID):
        # What stretches or yields does so about as much aside as it does at rest
        lengths = np.linalg.norm(ceiling - rest.position - hinges @ rest.R_world_body.T, axis=1)

    def placed(q: Array) -> tuple[Array, Rotation]:
        return rest.position + q[:3], Rotation.from_matrix(rest.R_world_body) * Rotation.from_rotvec(q[3:])

    def gaps(q: Array) -> Array:
        position, turn = placed(q)
        return np.asarray(np.linalg.norm(ceiling - position - turn.apply(hinges), axis=1) - lengths)

    found = minimize(
        lambda q: objective(*placed(q)),
        np.zeros(6),
        method="SLSQP",
        constraints={"type": "eq", "fun": gaps},
        options={"ftol": 1e-13, "maxiter": 300},
    )
    if not np.max(np.abs(gaps(found.x))) < 1e-5:
        return None
    position, turn = placed(found.x)
    aside = State(position, turn.as_matrix(), np.zeros(3), np.zeros(3), rest.internal)
    return on_cables(model, aside)
