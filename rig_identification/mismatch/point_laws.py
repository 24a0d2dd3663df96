"""Physics that no entry of the catalogue has, as a sparse law: a force at a point that follows its motion.

Three families (model/effects/point_law.py): a spring along some line with a linear, a square and a cubic
part, a brake with a linear and a square part that may fade with distance, and one along some line. Between
them they hold what hardens, softens, attracts, rubs and drags at one place, which is most of what hangs on or
near a body unnoticed.

Where it acts is tried (place_scan.py). A law has many numbers, and something of it bends to anything: it is
told only where it leaves nothing in any run and the catalogue does not come near it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.fitted import Fitted
from rig_identification.estimate.parameters import AXES, Parameter
from rig_identification.estimate.prediction import model_at
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.candidate import Candidate, Told, added
from rig_identification.mismatch.findings import written
from rig_identification.mismatch.place_scan import Scales, direction, followed, point_near_middle
from rig_identification.mismatch.plates import DRAG_ADVICE
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.effects.air_drag import AIR
from rig_identification.model.motion import Motion, RigModel
from rig_identification.quantity import plain_figure, with_interval
from rig_identification.result import Finding
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Lines along which a spring or a brake is tried at first: azimuth and elevation, rad.
LINES = ((0.0, 0.0), (0.5 * np.pi, 0.0), (0.25 * np.pi, 0.0), (-0.25 * np.pi, 0.0), (0.0, 1.3))
#: Widths of a brake's reach that are tried, in parts of the largest travel; 0: it does not fade.
NARROWS = (0.0, 0.5, 2.0)
#: How early a brake saturates: squares of the largest speed in parts of that at which it pulls most. A magnet
#: over copper does so at some cm/s, dry friction at once.
EARLY = (3.0, 30.0)
#: Factor between what is tried from a fit.
SHARPER = 30.0
#: How far a brake counts the vertical at first: between not at all, 0, and like any other direction, 1.
UPRIGHT = 0.5
#: Std of how far a brake along a line counts what is across it.
ACROSS_STD = 0.3
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


def spring_law(rig: Rig, scales: Scales, line: tuple[float, float]) -> Candidate:
    """A spring at a point about along ``line``, with every part."""
    block = layout.effects_offset(len(rig.cables))
    amounts = tuple(
        added(f"unknown.{name}", unit, scales.force / scales.travel ** (k + 1), block + place.LAW_SPRING + k)
        for k, (name, unit) in enumerate(SPRINGS)
    )
    return _law((*amounts, *_line(block, line), *_point(rig, scales)), 0)


def line_brake_law(rig: Rig, scales: Scales, line: tuple[float, float]) -> Candidate:
    """A brake at a point about along ``line``, with every part: a dashpot, a magnet, a slide in a slot."""
    block = layout.effects_offset(len(rig.cables))
    across = added("unknown.across", "1", ACROSS_STD, block + place.LAW_ACROSS)
    return _law((*_brake_amounts(block, scales), across, *_line(block, line), *_point(rig, scales)), 1)


def _line(block: int, line: tuple[float, float]) -> tuple[Parameter, ...]:
    """Angles of a law's line, near those of ``line``. block: first entry of the effects."""
    return tuple(
        added(f"unknown.{name}", "rad", TURNED, block + place.LAW_DIRECTION + i, line[i])
        for i, name in enumerate(("azimuth", "elevation"))
    )


def _brake_amounts(block: int, scales: Scales) -> tuple[Parameter, ...]:
    return tuple(
        added(f"unknown.{name}", unit, scales.force / scales.speed ** (k + 1), block + place.LAW_BRAKE + k)
        for k, (name, unit) in enumerate(BRAKES)
    )


def brake_law(rig: Rig, scales: Scales, early: float = 0.0) -> Candidate:
    """A brake at a point that may fade with distance, or saturates so ``early``, with every part."""
    block = layout.effects_offset(len(rig.cables))
    amounts = _brake_amounts(block, scales)
    bent = added("unknown.narrow", "1/m^2", 1.0 / scales.travel**2, block + place.LAW_NARROW)
    if early > 0.0:
        known = early / scales.speed**2
        # Where it saturates is known by its order of magnitude, and below zero it would not
        bent = replace(
            added("unknown.saturation", "s^2/m^2", 1.0, block + place.LAW_SATURATION, known), ratio=True
        )
    # The vertical part may count like any other, or not at all
    upright = added("unknown.upright", "1", 0.5, block + place.LAW_UPRIGHT, UPRIGHT)
    law = _law((*amounts, bent, upright, *_point(rig, scales)), 1)
    return replace(law, between=partial(_sharper, rig, scales, early)) if early > 0.0 else law


def _sharper(
    rig: Rig, scales: Scales, early: float, problem: Problem, evaluation: Evaluation
) -> list[tuple[Candidate, dict[str, float]]]:
    """A fitted brake that saturates so ``early`` as one that does so earlier, and pulls as hard then.

    Dry friction saturates at once. Between the two lies a valley: as it saturates earlier, a brake that pulls
    most at some speed first loses what it explains there.
    """
    values = problem.bench.parameters.named(evaluation.point.theta)
    law = brake_law(rig, scales, SHARPER * early)
    start = {q.name: values[q.name] for q in law.parameters if q.name in values}
    if len(start) < len(law.parameters):
        return []
    start["unknown.saturation"] *= SHARPER
    start["unknown.quadratic_damping"] *= SHARPER
    start["unknown.damping"] *= SHARPER**0.5
    return [(law, start)]


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
    return point_near_middle("unknown", rig, scales.size, place.LAW_POINT)


def _told(found: Estimates) -> Told:
    """Every number of a law that is in the model."""
    names = [n for n in found.values if n.startswith("unknown.")]
    units = dict(
        (
            *SPRINGS,
            *BRAKES,
            ("upright", "1"),
            ("across", "1"),
            ("narrow", "1/m^2"),
            ("saturation", "s^2/m^2"),
            ("azimuth", "rad"),
            ("elevation", "rad"),
        )
    )
    return {
        (short := n.removeprefix("unknown.").replace(".", "_")): (*found.of(n), units.get(short, "m"))
        for n in names
    }


@dataclass(frozen=True)
class Law:
    """What is tried of a law at every place: a spring or brake along a ``line``, or a brake to all sides."""

    line: tuple[float, float] | None
    brakes: bool = False  # along the line; without one every law is a brake
    narrow: float = 0.0  # in parts of what fades over the largest travel
    early: float = 0.0  # squares of the largest speed in parts of that from which on it saturates

    @property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """Names and units of its amounts."""
        return BRAKES if self.line is None or self.brakes else SPRINGS

    def candidate(self, rig: Rig, scales: Scales) -> Candidate:
        """The law with every part of it."""
        if self.line is not None:
            return (line_brake_law if self.brakes else spring_law)(rig, scales, self.line)
        return brake_law(rig, scales, self.early)

    def values(self, law: Candidate, at: Array, amounts: Array, scales: Scales) -> dict[str, float]:
        """Values of a ``law``'s parameters at the place ``at``. amounts: in units of their std."""
        own = {q.name: q for q in law.parameters}
        known = {f"unknown.point.{a}": float(at[i]) for i, a in enumerate(AXES)}
        if self.line is None and self.early > 0.0:
            known["unknown.saturation"] = self.early / scales.speed**2
        elif self.line is None:
            known["unknown.narrow"] = self.narrow / scales.travel**2
        else:
            known |= {"unknown.azimuth": self.line[0], "unknown.elevation": self.line[1]}
        names = [f"unknown.{name}" for name, _ in self.parts]
        return known | {n: own[n].value(float(z)) for n, z in zip(names, amounts, strict=True)}

    def makes_sense(self, amounts: Array) -> bool:
        """Whether any part of a brake takes energy out; a spring may have either sign."""
        return self.parts == SPRINGS or bool(np.any(amounts > 0.0))

    def wrenches(self, model: RigModel, motion: Motion, at: Array, scales: Scales) -> Array:
        """(N, 6, parts) wrench about the datum, body axes, of a std of each part at the place ``at``."""
        u, v = followed(model, motion, at)
        if self.line is not None and self.brakes:
            d = direction(*self.line)
            force = _brakes(u / scales.travel, (v @ d)[:, None] * d / scales.speed, 0.0, 0.0)
        elif self.line is not None:
            force = _pulls(u / scales.travel, *self.line)
        else:
            v = v * np.array([1.0, 1.0, UPRIGHT])
            force = _brakes(u / scales.travel, v / scales.speed, self.narrow, self.early)
        force = scales.force * force
        body = np.einsum("nji,njc->nic", motion.R_world_body, force)
        return np.concatenate([body, np.cross(at[None, :, None], body, axis=1)], axis=1)


#: All laws that are tried at every place.
LAWS = (
    *(Law(line) for line in LINES),
    *(Law(line, brakes=True) for line in LINES),
    *(Law(None, narrow=narrow) for narrow in NARROWS),
    *(Law(None, early=early) for early in EARLY),
)


def _pulls(u: Array, azimuth: float, elevation: float) -> Array:
    """(N, 3, 3) force of a unit of each part of a spring at travels ``u`` (N, 3), world."""
    d = direction(azimuth, elevation)
    s = (u @ d)[:, None]
    return np.asarray(-np.concatenate([s, s**2, s**3], axis=1)[:, None, :] * d[:, None])


def _brakes(u: Array, v: Array, narrow: float, early: float) -> Array:
    """(N, 3, 2) force of a unit of each part of a brake at travels ``u``, velocities ``v`` (N, 3), world."""
    fade = np.exp(-narrow * np.sum(u**2, axis=1)) / (1.0 + early * np.sum(v**2, axis=1))
    fade = fade[:, None, None]
    return np.asarray(-fade * np.stack([v, np.linalg.norm(v, axis=1)[:, None] * v], axis=2))


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
    if "across" in told:
        acts += f" along a line near {axis}"
    fades = " and fades with distance from where that point hangs at rest" if "narrow" in told else ""
    if "saturation" in told:
        fades = f", and saturates at about {plain_figure(float(told['saturation']['value']) ** -0.5)} m/s"
    size = float(np.max(extent(fitted.problem.bench.rig)))
    # A point slides along its own force's line without a change
    known = [float(told[f"point_{a}"]["std"]) < VAGUE * size for a in AXES]
    place_told = ", ".join(f"{p:.2f}" if k else "any" for p, k in zip(at, known, strict=True))
    text = (
        f"A force {acts} at ({place_told}) m of the body grows {grows}{fades}: "
        f"{plain_figure(rms)} N (root mean square), up to {plain_figure(peak)} N. "
    )
    where = {**plain.where, "axis": axis, "position": [float(v) for v in at]}
    if parts == ["quadratic_damping"] and not {"narrow", "saturation", "across"} & told.keys():
        # A force against the square of speed has a name, wherever it acts
        value, std = (float(told["quadratic_damping"][key]) / (0.5 * AIR) for key in ("value", "std"))
        told = written({"drag_area": (value, std, "m^2")}) | told
        where["axis"] = None
        text += f"That is the drag of the air on {with_interval(value, std, 'm^2')}. {DRAG_ADVICE}"
        return replace(plain, effect="air_drag", where=where, parameters=told, statement=text)
    return replace(plain, where=where, parameters=told, statement=text + candidate.advice)


def _force(model: RigModel, motion: Motion, at: Array) -> Array:
    """(N, 3) N, world: the law's force along a motion."""
    block = layout.effects_offset(model.cables)
    p, (u, v) = model.physics[block:], followed(model, motion, at)
    pulls = _pulls(u, *p[place.LAW_DIRECTION :][:2]) @ p[place.LAW_SPRING :][:3]
    v = v * np.array([1.0, 1.0, p[place.LAW_UPRIGHT]])
    d, across = direction(*p[place.LAW_DIRECTION :][:2]), p[place.LAW_ACROSS]
    v = across * v + (1.0 - across) * (v @ d)[:, None] * d
    brakes = _brakes(u, v, p[place.LAW_NARROW], p[place.LAW_SATURATION])
    return np.asarray(pulls + brakes @ p[place.LAW_BRAKE :][:2])
