"""How short an integration step has to be: by the body's bounce, by what swings within, by dry hinges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from rig_identification.model import layout
from rig_identification.model.body import tensor
from rig_identification.model.definite import definite
from rig_identification.model.effects.internal import STOP_FREQUENCY
from rig_identification.model.effects.place import (
    BENDING,
    CREEP,
    DAMPING,
    FRICTION,
    effects_block,
    internal_block,
)
from rig_identification.model.so3 import skew

if TYPE_CHECKING:
    from rig_identification.model.motion import RigModel

Array = NDArray[np.float64]

#: Longest step (s) that keeps rigid-cable motion of vehicle rigs (modes up to 1.5 Hz) within 1e-7 m in 10 s.
FINE_STEP = 0.0034
#: Longest step for fits: truncation of 1e-6 m, three orders below the sensors' noise.
FIT_STEP = 0.005
#: Longest step times the angular frequency of the body's fastest bounce on its cables: its frequency comes
#: out within 2e-4, the cables' stiffness within 4e-4.
RESOLVED = 0.4
#: ... and times that of an internal coordinate.
RESOLVED_INTERNAL = 0.5
#: Longest step times the rate (1/s) at which hinges stop the body when they creep. Beyond 2.78 a Runge-Kutta
#: step of fourth order throws it back faster than it came; motions chatter, and their derivatives grow with
#: every step.
STABLE = 2.5
#: Substeps for which hinges that creep slower yet are not followed.
MOST = 8
#: rad/s; a body that bounces faster than at 250 Hz is followed as if it bounced so. What bounces faster on
#: its cables is light and thin beyond what hangs on any, and each run would take minutes.
FASTEST = 2.0 * np.pi * 250.0


def substeps_for(model: RigModel, step: float, longest: float = FINE_STEP) -> int:
    """Substeps no longer than ``longest`` that resolve the stiffest mode.

    A Runge-Kutta step h slows a swing at angular frequency w by (w h)^4/120.
    """
    plain = max(
        1,
        int(np.ceil(step / longest - 1e-9)),
        int(np.ceil(step * _fastest_internal(model) / RESOLVED_INTERNAL)),
        min(MOST, int(np.ceil(step * stopping_rate(model) / STABLE))),
    )
    elastic = (model.modes == layout.ELASTIC) | (model.modes == layout.ELASTIC_ROD)
    if not np.any(elastic):
        return plain
    return max(plain, int(np.ceil(step * min(_bounce(model, elastic), FASTEST) / RESOLVED)))


def _bounce(model: RigModel, elastic: NDArray[np.bool_]) -> float:
    """Highest angular frequency (rad/s) of the body on its ``elastic`` cables, near the design pose."""
    along, body, length = _as_designed(model)
    lines = np.concatenate([along, np.cross(body, along)], axis=1)[elastic]
    stiffness = (model.cable_numbers()[:, layout.AXIAL_STIFFNESS] / length)[elastic]
    squared = eigh(lines.T @ (stiffness[:, None] * lines), definite(_mass(model)), eigvals_only=True)
    return float(np.sqrt(max(float(squared[-1]), 0.0)))


def _as_designed(model: RigModel) -> tuple[Array, Array, Array]:
    """Direction (n, 3), body's hinge (n, 3) m and length (n,) m of each cable, near the design pose."""
    cables = model.cable_numbers()
    body = cables[:, layout.BODY_POINT : layout.BODY_POINT + 3]
    ceiling = cables[:, layout.CEILING_POINT : layout.CEILING_POINT + 3]
    length = cables[:, layout.LENGTH]
    return hanging(ceiling, body, length), body, length


def _mass(model: RigModel) -> Array:
    """(6, 6) of velocity and rate at the body's datum, body axes."""
    inertial = model.physics[layout.INERTIAL : layout.INERTIAL + 10]
    moment = skew(inertial[1:4])  # h x A
    return np.block([[inertial[0] * np.eye(3), moment.T], [moment, tensor(inertial[4:])]])


def stopping_rate(model: RigModel) -> float:
    """Highest rate (1/s) at which the hinges stop the body near the design pose, rubbing as they creep.

    A hinge that turns against its cable at w is held with (d + f / sqrt(w^2 + c^2)) w: the most a step has to
    follow is the slope d + f/c at w = 0. The cable of direction e turns at e x (v + w x b) / l.
    """
    o = effects_block(model.cables)
    slope = model.physics[o + DAMPING] + model.physics[o + FRICTION] / model.physics[o + CREEP]
    upper, lower = slope + model.physics[o + BENDING], slope + model.physics[o + BENDING + 1]
    if max(upper, lower) <= 0.0:
        return 0.0
    held = np.zeros((6, 6))
    turning = np.concatenate([np.zeros((3, 3)), np.eye(3)], axis=1)
    for e, b, span in zip(*_as_designed(model), strict=True):
        cable = skew(e) @ np.concatenate([np.eye(3), -skew(b)], axis=1) / span
        held += lower * (turning - cable).T @ (turning - cable) + upper * cable.T @ cable
    return float(max(eigh(held, definite(_mass(model)), eigvals_only=True)[-1], 0.0))


def hanging(ceiling: Array, body: Array, lengths: Array) -> Array:
    """(n, 3) unit vectors along cables near the design pose: the body level, under its ceiling points."""
    drop = [0.0, 0.0, float(np.mean(lengths))]
    along = ceiling - body - np.mean(ceiling - body, axis=0) + drop
    return np.asarray(along / np.linalg.norm(along, axis=1, keepdims=True))


def _fastest_internal(model: RigModel) -> float:
    """Highest angular frequency (rad/s) of the internal coordinates."""
    fastest = 0.0
    for k in range(model.internal):
        o = internal_block(model.cables, k)
        stops = STOP_FREQUENCY if model.physics[o + layout.STOP] > 0.0 else 0.0
        fastest = max(fastest, 2.0 * np.pi * max(abs(model.physics[o + layout.FREQUENCY]), stops))
    return fastest
