"""Where on the body a force acts: places are tried, and the best one is closed in on.

A force that follows a point's motion has columns that are no polynomials of that point. So places are tried
on a grid that closes in, at the price of one pass of the linearised model each (response.py). For each of
them the amounts of its parts follow at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import AXES, Parameter
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.candidate import Candidate, added
from rig_identification.mismatch.opened import Promise, free_without
from rig_identification.mismatch.places import travel_of
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.riders import middle_of
from rig_identification.model import layout
from rig_identification.model.motion import Motion, RigModel
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Share of the weight that each part of a law is believed to come to at the body's largest travel or speed.
FORCE = 0.1
#: Places tried along each axis, the part of the rig's longest side that they reach from the middle, and by
#: what they close in on the best, so many times.
PLACES, REACH, CLOSER, ROUNDS = 3, 0.6, 0.5, 3
#: Part of the best gain up to which a shape's places are looked at no closer.
BEHIND = 0.5


def direction(azimuth: float, elevation: float) -> Array:
    """(3,) unit vector at these angles, rad."""
    level = np.cos(elevation)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])


@dataclass(frozen=True)
class Scales:
    """Sizes that belong to a session: force N, largest travel m and speed m/s of the body's middle."""

    force: float
    travel: float
    speed: float
    size: float  # m, the rig's longest side


def scales_of(problem: Problem, evaluation: Evaluation, mass: float) -> Scales:
    """Sizes about a fitted motion. mass: kg, roughly."""
    rig, model = problem.bench.rig, problem.bench.parameters.model
    at = middle_of(rig)
    pairs = [followed(model, run.motion, at) for run in evaluation.runs]
    travel = max(float(np.max(np.linalg.norm(u, axis=1))) for u, _ in pairs)
    speed = max(float(np.max(np.linalg.norm(v, axis=1))) for _, v in pairs)
    size = float(np.max(extent(rig)))
    return Scales(FORCE * mass * rig.gravity, max(travel, 1e-6), max(speed, 1e-6), size)


def point_near_middle(stem: str, rig: Rig, std: float, place: int) -> tuple[Parameter, ...]:
    """A point of the body, near its middle to ``std`` m. place: its first entry in the effects' block."""
    first = layout.effects_offset(len(rig.cables)) + place
    return tuple(
        added(f"{stem}.point.{a}", "m", std, first + i, float(at))
        for i, (a, at) in enumerate(zip(AXES, middle_of(rig), strict=True))
    )


class Shape(Protocol):
    """A force that is tried at every place."""

    @property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Names and units of its amounts."""

    def candidate(self, rig: Rig, scales: Scales) -> Candidate:
        """The hypothesis with every part of it."""

    def values(self, candidate: Candidate, at: Array, amounts: Array, scales: Scales) -> dict[str, float]:
        """Values of a ``candidate``'s parameters at the place ``at``. amounts: in units of their std."""

    def makes_sense(self, amounts: Array) -> bool:
        """Whether there can be such a force. amounts: in units of their std."""

    def wrenches(self, model: RigModel, motion: Motion, at: Array, scales: Scales) -> Array:
        """(N, 6, parts) wrench about the datum, body axes, of a std of each part at the place ``at``."""


@dataclass(frozen=True)
class _Place:
    """A shape's best place."""

    gain: float  # nats
    at: Array  # (3,) m
    amounts: Array  # in units of their std


def best_places(
    problem: Problem, evaluation: Evaluation, mass: float, shapes: tuple[Shape, ...]
) -> list[Promise]:
    """What each shape promises at its best place, to first order, best first. mass: kg, roughly."""
    rig, model = problem.bench.rig, problem.bench.parameters.model
    scales = scales_of(problem, evaluation, mass)
    base = free_without(problem, evaluation.point, evaluation, set(), 0)
    beyond = Beyond(evaluation, base, problem.bench.parameters.size)
    center, step = middle_of(rig), REACH * scales.size
    best: dict[Shape, _Place] = {}
    about = dict.fromkeys(shapes, center)
    for _ in range(1 + ROUNDS):
        for shape, found in _best_of(model, beyond, scales, about, step, center).items():
            if shape not in best or found.gain > best[shape].gain:
                best[shape] = found
        # What is far behind needs no closer look
        most = max((found.gain for found in best.values()), default=0.0)
        about = {shape: found.at for shape, found in best.items() if found.gain > BEHIND * most}
        step *= CLOSER
    left = max(1.0, excess(evaluation))
    out = []
    for shape, found in best.items():
        candidate = shape.candidate(rig, scales)
        values = shape.values(candidate, found.at, found.amounts, scales)
        out.append(Promise(candidate, found.gain, values, found.gain / left))
    return sorted(out, key=lambda promise: -promise.gain)


def _best_of(
    model: RigModel,
    beyond: Beyond,
    scales: Scales,
    about: dict[Shape, Array],
    step: float,
    center: Array,
) -> dict[Shape, _Place]:
    """Of each shape the best of the places ``about`` its own, ``step`` apart."""
    line, reach = np.linspace(-step, step, PLACES), REACH * scales.size
    offsets = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    places = [
        (shape, at)
        for shape, p in about.items()
        for at in np.clip(p + offsets, center - reach, center + reach)
    ]
    if not places:
        return {}
    runs = []
    for run in beyond.full.runs:
        wrenches = [shape.wrenches(model, run.motion, at, scales) for shape, at in places]
        runs.append(whitened_response(run, np.concatenate(wrenches, axis=2), smooth=True))
    found = beyond.of(runs)
    out: dict[Shape, _Place] = {}
    first = 0
    for shape, at in places:
        chosen = slice(first, first + len(shape.parts))
        first = chosen.stop
        part = found.part(chosen)
        matrix = part.information([r[:, chosen] for r in runs]) + np.eye(len(shape.parts))
        amounts = np.asarray(np.linalg.solve(matrix, part.right), dtype=np.float64)
        away = float(np.sum((at - center) ** 2)) / scales.size**2
        gain = 0.5 * float(part.right @ amounts) - 0.5 * away
        if shape.makes_sense(amounts) and (shape not in out or gain > out[shape].gain):
            out[shape] = _Place(gain, at, amounts)
    return out


def followed(model: RigModel, motion: Motion, at: Array) -> tuple[Array, Array]:
    """((N, 3) m, (N, 3) m/s) travel of the body's point ``at`` from where it hangs at rest, and velocity."""
    x = motion.states
    turning = np.cross(x[:, layout.RATE : layout.RATE + 3], at)
    v = x[:, layout.VELOCITY : layout.VELOCITY + 3] + np.einsum("nij,nj->ni", motion.R_world_body, turning)
    return travel_of(model, motion, at), np.asarray(v)
