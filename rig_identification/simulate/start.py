"""How a run starts: hanging at rest, pulled aside and let go, or let go in a given pose or beside rest."""

from __future__ import annotations

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

    shift: Array  # (3,) m, of the body datum in world
    turn: Array  # (3,) rad, about world x, then y, then z, through the body datum


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
    given = _displaced(start, rest) if isinstance(start, Displaced) else _posed(start)
    state = on_cables(model, given)
    moved = float(np.linalg.norm(state.position - given.position))
    if not moved < FURTHEST:
        raise InputError(
            f"start: the nearest pose on the cables is {moved:.3g} m away from the given one; check it"
        )
    return state


def _posed(start: Posed) -> State:
    R = Rotation.from_quat(start.orientation).as_matrix()
    return State(np.array(start.position, dtype=float), R, np.zeros(3), np.zeros(3))


def _displaced(start: Displaced, rest: State) -> State:
    R = Rotation.from_euler("xyz", start.turn).as_matrix() @ rest.R_world_body
    return State(rest.position + start.shift, R, np.zeros(3), np.zeros(3))


def _pulled_aside(model: RigModel, pull: Pulled, rest: State) -> State:
    """Least potential energy under the pull with every rigid cable at its length."""
    physics = model.physics
    gravity, moment = physics[:3], physics[layout.INERTIAL + 1 : layout.INERTIAL + 4]
    mass = physics[layout.INERTIAL]
    offsets = [layout.cable_offset(i) for i in range(model.cables)]
    ceiling = np.array([physics[o + layout.CEILING_POINT : o + layout.CEILING_POINT + 3] for o in offsets])
    hinges = np.array([physics[o + layout.BODY_POINT : o + layout.BODY_POINT + 3] for o in offsets])
    lengths = np.array([physics[o + layout.LENGTH] for o in offsets])
    if model.internal or np.any(model.modes != layout.RIGID):
        # What stretches or yields does so about as much aside as it does at rest
        lengths = np.linalg.norm(ceiling - rest.position - hinges @ rest.R_world_body.T, axis=1)
    weight = mass * float(np.linalg.norm(gravity))

    def placed(q: Array) -> tuple[Array, Rotation]:
        return rest.position + q[:3], Rotation.from_matrix(rest.R_world_body) * Rotation.from_rotvec(q[3:])

    def energy(q: Array) -> float:
        position, turn = placed(q)
        fallen = gravity @ (mass * position + turn.apply(moment))
        return -float((fallen + pull.force @ (position + turn.apply(pull.point))) / weight)

    def gaps(q: Array) -> Array:
        position, turn = placed(q)
        return np.asarray(np.linalg.norm(ceiling - position - turn.apply(hinges), axis=1) - lengths)

    found = minimize(
        energy,
        np.zeros(6),
        method="SLSQP",
        constraints={"type": "eq", "fun": gaps},
        options={"ftol": 1e-13, "maxiter": 300},
    )
    if not np.max(np.abs(gaps(found.x))) < 1e-5:
        size = float(np.linalg.norm(pull.force))
        raise InputError(f"start: no pose holds against a pull of {size:.4g} N; pull less")
    position, turn = placed(found.x)
    aside = State(position, turn.as_matrix(), np.zeros(3), np.zeros(3), rest.internal)
    return on_cables(model, aside)
