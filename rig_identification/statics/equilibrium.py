"""The thesis' case generator: where a body with a known centre of mass comes to rest.

A rigid cable holds a hinge within its length. The body rests where the potential energy is
least under |e_i| <= l_i, and the multipliers of those bounds are the tensions, so none is
negative. All equilibria with every cable taut are found first; where there is none, subsets of
the cables are tried, the rest hanging slack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.recording import Dummy
from rig_identification.rig import Rig
from rig_identification.statics.balance import Suspension, spans
from rig_identification.statics.poses import HangingPose, poses_with_known_mass

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True)
class Equilibrium:
    """A body at rest."""

    position: Array  # (3,) m, body origin in world
    orientation: Array  # (4,) quaternion xyzw, rotates body vectors into world
    tension: Array  # (n,) N, zero where slack
    slack: tuple[str, ...]  # names of the cables that hang slack
    potential_energy: float  # J, zero where the mass is level with the world's origin
    undetermined_tensions: int  # combinations of tensions that rigid cables leave open


@dataclass(frozen=True)
class EquilibriumSearch:
    """What the search found: stable equilibria, lowest first.

    ``status``: ``"one"``, every cable is taut in exactly one stable equilibrium; ``"several"``,
    in more than one; ``"slack"``, in none, and the equilibria have slack cables;
    ``"none"``, no stable equilibrium was found at all.
    """

    status: str
    equilibria: tuple[Equilibrium, ...]
    statement: str


def find_equilibria(
    rig: Rig, mass: float, center_of_mass: Array, dummy: Dummy | None = None
) -> EquilibriumSearch:
    """Find where a body of ``mass`` (kg) with its centre at (3,) m, body, comes to rest.

    ``dummy`` hangs with it. Starts lie all round the circle, none has to be given.
    """
    suspension = Suspension.of(rig)
    total, arm = hanging_mass(mass, np.asarray(center_of_mass, dtype=float), dummy)
    weight = total * rig.gravity
    names = [cable.name for cable in rig.cables]
    taut = [pose for pose in poses_with_known_mass(suspension, arm) if pose.stable and pose.taut]
    if taut:
        found = tuple(_equilibrium(pose, names, np.arange(len(names)), weight, arm) for pose in taut)
        if len(found) == 1:
            return EquilibriumSearch("one", found, "One stable equilibrium with every cable taut.")
        return EquilibriumSearch("several", found, f"{len(found)} stable equilibria have every cable taut.")
    found = _with_slack(suspension, names, weight, arm)
    if not found:
        return EquilibriumSearch("none", (), "No stable equilibrium: the body cannot hang on these cables.")
    slack = ", ".join(found[0].slack)
    return EquilibriumSearch("slack", found, f"No equilibrium keeps every cable taut: slack are {slack}.")


def hanging_mass(mass: float, center_of_mass: Array, dummy: Dummy | None) -> tuple[float, Array]:
    """Mass (kg) and centre (3,) m, body, of all that hangs (thesis section 2.2.3)."""
    if dummy is None:
        return mass, center_of_mass
    total = mass + dummy.mass
    return total, np.asarray((mass * center_of_mass + dummy.mass * dummy.position) / total)


def _with_slack(
    suspension: Suspension, names: list[str], weight: float, arm: Array
) -> tuple[Equilibrium, ...]:
    """The equilibrium that descent under |e_i| <= l_i runs into, with its taut cables solved exactly."""
    for turn in (0.0, 0.1, -0.1):
        taut = _taut_after_descent(suspension, arm, turn)
        if len(taut) == 0:
            continue
        loose = np.setdiff1d(np.arange(len(names)), taut)
        for pose in poses_with_known_mass(suspension.only(taut), arm):
            distance = spans(suspension, pose.position, pose.attitude)[2]
            if pose.stable and pose.taut and np.all(distance[loose] < suspension.length[loose]):
                return (_equilibrium(pose, names, taut, weight, arm),)
    return ()


def _taut_after_descent(suspension: Suspension, arm: Array, turn: float) -> Indices:
    """Indices of the cables that hold the body at the end of a descent from upright."""
    upright = Rotation.from_rotvec([turn, turn, turn])
    above = suspension.ceiling.mean(0) - upright.apply(suspension.body.mean(0))
    start = above - np.array([0.0, 0.0, 0.5 * suspension.length.mean()])

    def placed(x: Array) -> tuple[Array, Array]:
        return start + x[:3], (Rotation.from_rotvec(x[3:]) * upright).as_matrix()

    def height(x: Array) -> float:
        position, attitude = placed(x)
        return float((position + attitude @ arm)[2])

    def room(x: Array) -> Array:
        return suspension.length - spans(suspension, *placed(x))[2]

    from scipy.optimize import minimize  # takes a tenth of a second: not for the balance of given poses

    found = minimize(
        height,
        np.zeros(6),
        method="SLSQP",
        constraints={"type": "ineq", "fun": room},
        options={"maxiter": 500, "ftol": 1e-14},
    )
    return np.flatnonzero(room(found.x) < 1e-5)


def _equilibrium(
    pose: HangingPose, names: list[str], taut: Indices, weight: float, arm: Array
) -> Equilibrium:
    tension = np.zeros(len(names))
    tension[taut] = weight * pose.tension
    height = (pose.position + pose.attitude @ arm)[2]
    return Equilibrium(
        position=pose.position,
        orientation=Rotation.from_matrix(pose.attitude).as_quat(),
        tension=tension,
        slack=tuple(name for i, name in enumerate(names) if i not in set(taut.tolist())),
        potential_energy=float(weight * height),
        undetermined_tensions=pose.undetermined_tensions,
    )
