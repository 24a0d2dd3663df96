"""Turns about the vertical under which a rig falls on itself.

Half a circle for two threads, a third for three of a regular triangle: turned by as much, body and all, a
rig swings as it did. Rigs are regular within tolerances.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig_identification.model.equilibrium import design_pose
from rig_identification.model.motion import RigModel, rig_model
from rig_identification.model.so3 import nearest_rotation
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Tolerances that a turned rig's hinges and threads may be off the described one's; beyond, it is another.
ALIKE = 5.0
#: Threads whose exchanges are tried all.
MOST = 6
#: m that a description's digits may leave of a regular rig.
ROUNDING = 2e-4
#: rad below which two turns are one, and none is one.
SAME = 0.1
#: Weight of the vertical beside the hinges.
LITTLE = 1e-3


@dataclass(frozen=True)
class Turn:
    """One way in which the rig falls on itself."""

    angle: float  # rad about the vertical, in (-pi, pi]
    R: Array  # (3, 3) S, body axes
    middle: Array  # (3,) m, h, body frame
    off: dict[str, float]  # parameter name -> d of it, m

    @property
    def exact(self) -> bool:
        """Whether hinges and threads fall on each other as described."""
        return max(map(abs, self.off.values())) < ROUNDING


def turns(rig: Rig, up: Array | None = None) -> list[Turn]:
    """The turns, other than none, under which a rig falls on itself within tolerances; smallest first.

    up: (3,) the vertical in body axes as the body hangs; as designed where it is left out.
    """
    if len(rig.cables) > MOST:
        return []
    up = design_pose(_any_body(rig)).R_world_body[2] if up is None else up
    found: list[Turn] = []
    for turn in _tried(rig, up):
        known = [abs(np.angle(np.exp(1j * (turn.angle - other.angle)))) < SAME for other in found]
        if abs(turn.angle) > SAME and not any(known):
            found.append(turn)
    return sorted(found, key=lambda turn: (abs(turn.angle), turn.angle))


def _tried(rig: Rig, up: Array) -> Iterator[Turn]:
    """Each exchange of the threads, turned as it fits best, where that is within tolerances."""
    body = np.array([cable.body_point for cable in rig.cables])
    ceiling = np.array([cable.ceiling_point for cable in rig.cables])
    length = np.array([cable.length for cable in rig.cables])
    middle = np.mean(body, axis=0)
    body, ceiling = body - middle, ceiling - np.mean(ceiling, axis=0)
    for order in permutations(range(len(rig.cables))):
        there = list(order)
        cross = ceiling[:, 0] * ceiling[there, 1] - ceiling[:, 1] * ceiling[there, 0]
        angle = float(np.arctan2(np.sum(cross), np.sum(ceiling[:, :2] * ceiling[there, :2])))
        S_ceiling = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
        S_body = _best_turn(body, body[there], up)
        if np.linalg.norm(S_body - Rotation.from_rotvec(angle * up).as_matrix()) > SAME:
            continue
        at_body, at_ceiling = body[there] @ S_body - body, ceiling[there] @ S_ceiling - ceiling
        longer = length[there] - length
        if (
            max(np.max(np.abs(at_body)), np.max(np.abs(at_ceiling))) > ALIKE * rig.tolerance["hinge_position"]
            or np.max(np.abs(longer)) > ALIKE * rig.tolerance["cable_length"]
        ):
            continue
        off = {}
        for i, cable in enumerate(rig.cables):
            off[f"{cable.name}.length"] = float(longer[i])
            for end, vector in (("body_point", at_body[i]), ("ceiling_point", at_ceiling[i])):
                off |= {f"{cable.name}.{end}.{axis}": float(v) for axis, v in zip("xyz", vector, strict=True)}
        yield Turn(angle, S_body, middle, off)


def _best_turn(points: Array, there: Array, up: Array) -> Array:
    """(3, 3) rotation that brings points best to others and keeps ``up`` (Markley, see watched_mount.py).

    Points on a line or in a plane leave that open; they have the say in all else.
    """
    return nearest_rotation(there.T @ points + LITTLE * np.sum(points**2) * np.outer(up, up))


def _any_body(rig: Rig) -> RigModel:
    """The rig with some body on it: how three threads and more have it hang depends on none."""
    size = max(cable.length for cable in rig.cables)
    center = np.mean([cable.body_point for cable in rig.cables], axis=0) - [0.0, 0.0, 0.2 * size]
    moment = 0.1 * size**2
    return rig_model(rig, np.concatenate([[1.0], center, [moment, 0.0, 0.0, moment, 0.0, moment]]))
