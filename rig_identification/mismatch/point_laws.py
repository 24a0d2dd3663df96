"""Physics that no entry of the catalogue has, as a sparse law: a force at a point that follows its motion.

Two families (model/effects/point_law.py): a spring along some line with a linear, a square and a cubic part,
and a brake with a linear and a square part that may fade with distance. Between them they hold what hardens,
softens, attracts, rubs and drags at one place, which is most of what hangs on or near a body unnoticed.

A law's columns are no polynomials of its place, so places are tried on a grid that closes in, at the price of
one pass of the linearised model each (response.py). A law has many numbers, and something of it bends to
anything: it is told only where it leaves nothing in any run and the catalogue does not come near it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.parameters import AXES, Parameter
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Problem, excess
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.candidate import Candidate, Told, added
from rig_identification.mismatch.findings import written
from rig_identification.mismatch.places import travel_of
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.riders import middle_of
from rig_identification.mismatch.screen import Promise, free_without
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import Motion, RigModel
from rig_identification.quantity import plain_figure, with_interval
from rig_identification.result import Finding
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Share of the weight that each part of a law is believed to come to at the body's largest travel or speed.
FORCE = 0.1
#: Places tried along each axis, the part of the rig's longest side that they reach from the middle, and by
#: what they close in on the best, so many times.
PLACES, REACH, CLOSER, ROUNDS = 3, 0.6, 0.5, 3
#: Part of the best gain up to which a shape's places are looked at no closer.
BEHIND = 0.5
#: Lines along which a spring is tried at first: azimuth and elevation, rad.
LINES = ((0.0, 0.0), (0.5 * np.pi, 0.0), (0.25 * np.pi, 0.0), (-0.25 * np.pi, 0.0), (0.0, 1.3))
#: Widths of a brake's reach that are tried, in parts of the largest travel; 0: it does not fade.
NARROWS = (0.0, 0.5, 2.0)
#: Std of a line's angles, rad.
TURNED = 0.5
#: Contract-like names and units of the parts.
SPRINGS = (("stiffness", "N/m"), ("quadratic_stiffness", "N/m^2"), ("cubic_stiffness", "N/m^3"))
BRAKES = (("damping", "N*s/m"), ("quadratic_damping", "N*s^2/m^2"))
#: What such a part follows, for a sentence.
WORDS = {
    "stiffness": "in proportion to displacement",
    "quadratic_stiffness": "with the square of displacement",
    "cubic_stiffness": "with the cube of displacement",
    "damping": "in proportion to velocity",
    "quadratic_damping": "with the square of velocity",
}
ADVICE = (
    "No entry of the catalogue has it: look for what touches, pulls, attracts or brakes the body there, take "
    "it away, or keep the law in the model."
)


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
    pairs = [_followed(model, run.motion, at) for run in evaluation.runs]
    travel = max(float(np.max(np.linalg.norm(u, axis=1))) for u, _ in pairs)
    speed = max(float(np.max(np.linalg.norm(v, axis=1))) for _, v in pairs)
    size = float(np.max(extent(rig)))
    return Scales(FORCE * mass * rig.gravity, max(travel, 1e-6), max(speed, 1e-6), size)


def spring_law(rig: Rig, scales: Scales, line: tuple[float, float]) -> Candidate:
    """A spring at a point about along ``line``, with every part."""
    block = layout.effects_offset(len(rig.cables))
    amounts = tuple(
        added(f"unknown.{name}", unit, scales.force / scales.travel ** (k + 1), block + place.LAW_SPRING + k)
        for k, (name, unit) in enumerate(SPRINGS)
    )
    angles = tuple(
        added(f"unknown.{name}", "rad", TURNED, block + place.LAW_DIRECTION + i, line[i])
        for i, name in enumerate(("azimuth", "elevation"))
    )
    return _law((*amounts, *angles, *_point(rig, scales)), 0)


def brake_law(rig: Rig, scales: Scales) -> Candidate:
    """A brake at a point that may fade with distance, with every part."""
    block = layout.effects_offset(len(rig.cables))
    amounts = tuple(
        added(f"unknown.{name}", unit, scales.force / scales.speed ** (k + 1), block + place.LAW_BRAKE + k)
        for k, (name, unit) in enumerate(BRAKES)
    )
    narrow = added("unknown.narrow", "1/m^2", 1.0 / scales.travel**2, block + place.LAW_NARROW)
    return _law((*amounts, narrow, *_point(rig, scales)), 1)


def _law(parameters: tuple[Parameter, ...], positive: int) -> Candidate:
    return Candidate(
        "unknown",
        parameters,
        "Something acts on the body that no entry of the catalogue has.",
        ADVICE,
        {"channel": None, "axis": None},
        positive=positive,
        tell=_told,
        curved=True,
    )


def _point(rig: Rig, scales: Scales) -> tuple[Parameter, ...]:
    """The point of the body that the law is about."""
    entry, middle = layout.effects_offset(len(rig.cables)) + place.LAW_POINT, middle_of(rig)
    return tuple(
        added(f"unknown.point.{a}", "m", scales.size, entry + i, float(middle[i])) for i, a in enumerate(AXES)
    )


def _told(found: Estimates) -> Told:
    """Every number of a law that is in the model."""
    names = [n for n in found.values if n.startswith("unknown.")]
    units = dict((*SPRINGS, *BRAKES, ("narrow", "1/m^2"), ("azimuth", "rad"), ("elevation", "rad")))
    return {
        (short := n.removeprefix("unknown.").replace(".", "_")): (*found.of(n), units.get(short, "m"))
        for n in names
    }


@dataclass(frozen=True)
class Shape:
    """What is tried of a law at every place: a spring along a ``line``, or a brake that fades so fast."""

    line: tuple[float, float] | None
    narrow: float = 0.0  # in parts of what fades over the largest travel

    @property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Names and units of its amounts."""
        return BRAKES if self.line is None else SPRINGS

    def candidate(self, rig: Rig, scales: Scales) -> Candidate:
        """The law with every part of it."""
        return brake_law(rig, scales) if self.line is None else spring_law(rig, scales, self.line)

    def values(self, law: Candidate, at: Array, amounts: Array, scales: Scales) -> dict[str, float]:
        """Values of a ``law``'s parameters at the place ``at``. amounts: in units of their std."""
        own = {q.name: q for q in law.parameters}
        known = {f"unknown.point.{a}": float(at[i]) for i, a in enumerate(AXES)}
        if self.line is None:
            known["unknown.narrow"] = self.narrow / scales.travel**2
        else:
            known |= {"unknown.azimuth": self.line[0], "unknown.elevation": self.line[1]}
        names = [f"unknown.{name}" for name, _ in self.parts]
        return known | {n: own[n].value(float(z)) for n, z in zip(names, amounts, strict=True)}

    def makes_sense(self, amounts: Array) -> bool:
        """Whether any part of a brake takes energy out; a spring may have either sign."""
        return self.line is not None or bool(np.any(amounts > 0.0))

    def wrenches(self, model: RigModel, motion: Motion, at: Array, scales: Scales) -> Array:
        """(N, 6, parts) wrench about the datum, body axes, of a std of each part at the place ``at``."""
        u, v = _followed(model, motion, at)
        if self.line is not None:
            force = _pulls(u / scales.travel, *self.line)
        else:
            force = _brakes(u / scales.travel, v / scales.speed, self.narrow)
        force = scales.force * force
        body = np.einsum("nji,njc->nic", motion.R_world_body, force)
        return np.concatenate([body, np.cross(at[None, :, None], body, axis=1)], axis=1)


#: All that is tried at every place.
SHAPES = (*(Shape(line) for line in LINES), *(Shape(None, narrow) for narrow in NARROWS))


def _direction(azimuth: float, elevation: float) -> Array:
    """(3,) unit vector of a line."""
    level = np.cos(elevation)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])


def _pulls(u: Array, azimuth: float, elevation: float) -> Array:
    """(N, 3, 3) force of a unit of each part of a spring at travels ``u`` (N, 3), world."""
    d = _direction(azimuth, elevation)
    s = (u @ d)[:, None]
    return np.asarray(-np.concatenate([s, s**2, s**3], axis=1)[:, None, :] * d[:, None])


def _brakes(u: Array, v: Array, narrow: float) -> Array:
    """(N, 3, 2) force of a unit of each part of a brake at travels ``u``, velocities ``v`` (N, 3), world."""
    fade = np.exp(-narrow * np.sum(u**2, axis=1))[:, None, None]
    return np.asarray(-fade * np.stack([v, np.linalg.norm(v, axis=1)[:, None] * v], axis=2))


@dataclass(frozen=True)
class _Place:
    """A shape's best place."""

    gain: float  # nats
    at: Array  # (3,) m
    amounts: Array  # in units of their std


def point_laws(problem: Problem, evaluation: Evaluation, mass: float) -> list[Promise]:
    """What each shape promises at its best place, to first order, best first. mass: kg, roughly."""
    rig, model = problem.bench.rig, problem.bench.parameters.model
    scales = scales_of(problem, evaluation, mass)
    base = free_without(problem, evaluation.point, evaluation, set(), 0)
    beyond = Beyond(evaluation, base, problem.bench.parameters.size)
    center, step = middle_of(rig), REACH * scales.size
    best: dict[Shape, _Place] = {}
    about = dict.fromkeys(SHAPES, center)
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


def _followed(model: RigModel, motion: Motion, at: Array) -> tuple[Array, Array]:
    """((N, 3) m, (N, 3) m/s) travel of the body's point ``at`` from where it hangs at rest, and velocity."""
    x = motion.states
    turning = np.cross(x[:, layout.RATE : layout.RATE + 3], at)
    v = x[:, layout.VELOCITY : layout.VELOCITY + 3] + np.einsum("nij,nj->ni", motion.R_world_body, turning)
    return travel_of(model, motion, at), np.asarray(v)


#: Std of a point's coordinate, in parts of the rig's longest side, beyond which it is told as any.
VAGUE = 0.2
#: Std by which a part of a law has to be seen to stay.
SEEN = 3.0


def parts_of(candidate: Candidate) -> list[Parameter]:
    """The amounts of a law: what a force grows by."""
    return [q for q in candidate.parameters if q.name.removeprefix("unknown.") in WORDS]


def sparser(candidate: Candidate, seen: dict[str, float]) -> Candidate | None:
    """The law less the part that is seen least; None where every one is seen, or it is the last.

    seen: each parameter's position in units of its own std, by name. What is not seen of a brake's fading
    goes first.
    """
    if abs(seen.get("unknown.narrow", SEEN)) < SEEN:
        return _without(candidate, "unknown.narrow")
    parts = [q.name for q in parts_of(candidate)]
    least = min(parts, key=lambda name: abs(seen[name]))
    if len(parts) == 1 or abs(seen[least]) >= SEEN:
        return None
    return _without(candidate, least)


def _without(candidate: Candidate, name: str) -> Candidate:
    return replace(candidate, parameters=tuple(q for q in candidate.parameters if q.name != name))


def law_finding(fitted: Fitted, candidate: Candidate, plain: Finding) -> Finding:
    """The finding of a law in words and numbers: ``plain`` with where, how strong and what it follows."""
    parameters = fitted.problem.bench.parameters
    values = parameters.named(fitted.evaluation.point.theta)
    model = model_at(parameters, fitted.evaluation.point.theta)
    at = np.array([values[f"unknown.point.{a}"] for a in AXES])
    forces = [_force(model, run.motion, at) for run in fitted.evaluation.runs]
    sizes = np.concatenate([np.linalg.norm(f, axis=1) for f in forces])
    strength = np.sqrt(np.mean(np.concatenate(forces) ** 2, axis=0))
    axis = AXES[int(np.argmax(strength))]
    parts = [q.name.removeprefix("unknown.") for q in parts_of(candidate)]
    told: dict[str, Any] = dict(plain.parameters)
    first = max(parts, key=lambda name: abs(float(told[name]["value"])) / float(told[name]["std"]))
    share = float(told[first]["std"]) / abs(float(told[first]["value"]))
    rms, peak = float(np.sqrt(np.mean(sizes**2))), float(np.max(sizes))
    told = {first: told.pop(first)} | told
    told |= written({"force": (rms, share * rms, "N"), "peak_force": (peak, share * peak, "N")})
    grows = " and ".join(
        f"{WORDS[name]} ({with_interval(told[name]['value'], told[name]['std'], told[name]['unit'])})"
        for name in parts
    )
    acts = f"along {axis}" if parts[0] in dict(SPRINGS) else "against its motion"
    fades = " and fades with distance from where that point hangs at rest" if "narrow" in told else ""
    size = float(np.max(extent(fitted.problem.bench.rig)))
    # A point slides along its own force's line without a change
    known = [float(told[f"point_{a}"]["std"]) < VAGUE * size for a in AXES]
    place_told = ", ".join(f"{p:.2f}" if k else "any" for p, k in zip(at, known, strict=True))
    text = (
        f"A force {acts} at ({place_told}) m of the body grows {grows}{fades}: "
        f"{plain_figure(rms)} N (root mean square), up to {plain_figure(peak)} N. {candidate.advice}"
    )
    where = {**plain.where, "axis": axis, "position": [float(v) for v in at]}
    return replace(plain, where=where, parameters=told, statement=text)


def _force(model: RigModel, motion: Motion, at: Array) -> Array:
    """(N, 3) N, world: the law's force along a motion."""
    block = layout.effects_offset(model.cables)
    p, (u, v) = model.physics[block:], _followed(model, motion, at)
    pulls = _pulls(u, *p[place.LAW_DIRECTION :][:2]) @ p[place.LAW_SPRING :][:3]
    return np.asarray(pulls + _brakes(u, v, p[place.LAW_NARROW]) @ p[place.LAW_BRAKE :][:2])
