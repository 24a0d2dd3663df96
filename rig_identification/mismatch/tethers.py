"""A hose or wire that pulls on the body: where it does, what is told of it, and what it promises.

To first order a tether of stiffness k along d at the place p of the body puts the force -k d d^T (u + t x p)
there, u and t being the body's travel and turn: a polynomial of second degree in p (places.py).

What is taut turns with the body and does not push: past where it hangs free first order ends, and what pulls
there half of the time passes for something softer that pulls all the time. What first order finds is tried
with a wall on either side (model/effects/tether.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.estimates import Estimates, estimates
from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.growing import NEAR_SQUARE, misfit
from rig_identification.estimate.parameters import AXES, INERTIAL, Parameter
from rig_identification.estimate.solve import Evaluation, Point, Problem, evaluate
from rig_identification.mismatch.beyond import Beyond
from rig_identification.mismatch.candidate import Candidate, Told, added
from rig_identification.mismatch.places import (
    TERMS,
    Best,
    best_place,
    design,
    lines,
    monomials,
    placed_wrench,
    travel,
    travel_of,
)
from rig_identification.mismatch.response import whitened_response
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import Motion
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Pull, as a share of the weight, up to which a hose is believed of, and the length (m) of one that pulls as
#: hard as that and resists sideways most.
PULL, SHORT_HOSE = 0.02, 1.0
ADVICE = "Let cables and hoses hang free in a long loop, or take them off."
#: s: a hose's damping over the weight and the cables' length, and the std of its logarithm. It loses
#: some tenths of what it is stretched by in a swing, and never gives: 30 N/m that lose a fifth at 0.5 Hz
#: damp by 2 N s/m.
DAMPED, DAMPED_SPREAD = 0.002, 1.2
#: Places lie within so much of the rig's longest side about the middle.
REACH = 0.6
#: Length (m) of a hose that is known no better, and the std of its logarithm.
HOSE, HOSE_SPREAD = 1.5, 0.7
#: Std by which a pull has to be more than what comes off it for a hose to be certainly taut all the time.
CERTAIN = 3.0
#: Gain (nats) of a tether's stiffness beyond its pull, below which it pulls steadily as far as can be seen.
STIFF = 3.0


def tethers(rig: Rig, mass: float) -> list[Candidate]:
    """A tether along each axis, and one along all. mass: kg, roughly."""
    return [_tether(axes, rig, mass) for axes in (*AXES, "".join(AXES))]


def _middle(rig: Rig) -> Array:
    """(3,) m: the middle of a body that hangs below its hinges."""
    points = np.array([c.body_point for c in rig.cables])
    return np.asarray(np.mean(points, axis=0) - [0.0, 0.0, 0.3 * float(np.max(extent(rig)))])


def _amounts(axes: str, rig: Rig, mass: float) -> tuple[Parameter, ...]:
    """Stiffnesses along ``axes``, then pulls."""
    block = layout.effects_offset(len(rig.cables))
    length = float(np.mean([c.length for c in rig.cables]))
    return tuple(
        added(f"tether.{what}.{a}", unit, std, block + entry + AXES.index(a))
        for what, unit, std, entry in (
            ("stiffness", "N/m", 0.2 * mass * rig.gravity / length, place.TETHER_STIFFNESS),
            ("pull", "N", PULL * mass * rig.gravity, place.TETHER_PULL),
        )
        for a in axes
    )


def _point(rig: Rig) -> tuple[Parameter, ...]:
    """The point of the body that is pulled at."""
    entry = layout.effects_offset(len(rig.cables)) + place.TETHER_POINT
    size, middle = float(np.max(extent(rig))), _middle(rig)
    return tuple(
        added(f"tether.point.{a}", "m", size, entry + i, float(middle[i])) for i, a in enumerate(AXES)
    )


def _told(axes: str, found: Estimates) -> Told:
    """A tether along ``axes`` as the contract names it."""

    def of(name: str, unit: str) -> tuple[float, float, str]:
        return *found.of(f"tether.{name}"), unit

    stiff = {a: of(f"stiffness.{a}", "N/m") for a in axes}
    out: Told = {"stiffness": max(stiff.values(), key=lambda told: abs(told[0]))}
    if len(axes) == 1:
        pull, std, unit = of(f"pull.{axes}", "N")
        out["preload"] = (abs(pull), std, unit)
    else:
        out |= {f"stiffness_{a}": told for a, told in stiff.items()}
        out |= {f"pull_{a}": of(f"pull.{a}", "N") for a in axes}
    return out | {f"point_{a}": of(f"point.{a}", "m") for a in AXES}


def _tether(axes: str, rig: Rig, mass: float) -> Candidate:
    """A tether that pulls along ``axes``: along one as a taut hose does, along all as one that hangs.

    What is taut resists sideways as well, by its pull over its length F0/l alike to both sides: too little to
    show by itself, and enough to stand for a centre of mass that lies millimetres higher.
    """
    parts = _amounts(axes, rig, mass)
    so = "a stiffness of {value}"
    if len(axes) == 1:
        so = "{told[preload]} at rest and a stiffness of {value}"
        entry = layout.effects_offset(len(rig.cables)) + place.TETHER_STIFFNESS
        first, second = (entry + i for i, a in enumerate(AXES) if a != axes)
        aside = added("tether.sideways", "N/m", PULL * mass * rig.gravity / SHORT_HOSE, first)
        parts = (*parts, replace(aside, also=(second,)))
    return Candidate(
        "tether",
        (*parts, *_point(rig)),
        f"A hose or wire pulls on the body with {so}.",
        ADVICE,
        {"channel": None, "axis": axes if len(axes) == 1 else None},
        positive=len(axes),
        either_way=len(axes),
        tell=partial(_told, axes),
        closer=partial(_hoses, mass),
        between=partial(_lines, mass),
    )


def _hose(axis: str, side: float, rig: Rig, mass: float) -> Candidate:
    """A taut hose to a wall on the ``side`` (-1 or 1) of an axis."""
    stiffness, pull = _amounts(axis, rig, mass)
    entry = layout.effects_offset(len(rig.cables)) + place.TETHER_REACH + AXES.index(axis)
    reach = replace(added(f"tether.reach.{axis}", "m", HOSE_SPREAD, entry, side * HOSE), ratio=True)
    return Candidate(
        "tether",
        (stiffness, pull, reach, *_point(rig)),
        "A taut hose or wire pulls on the body with {told[preload]} at rest and a stiffness of {value}; it "
        "only pulls, and hangs free where the body swings far towards its other end.",
        ADVICE,
        {"channel": None, "axis": axis},
        positive=1,
        either_way=1,
        tell=partial(_told, axis),
    )


def _line(rig: Rig, mass: float, reach: Array) -> Candidate:
    """A hose or wire from a point of the body to one of the room, in any direction.

    reach (3,): m, world, from where its point hangs at rest, where a fit of it starts.
    """
    block = layout.effects_offset(len(rig.cables))
    length = float(np.mean([c.length for c in rig.cables]))
    weight = mass * rig.gravity

    first, size = block + place.TETHER_STIFFNESS, float(np.max(extent(rig)))
    amounts = (
        # The same along each axis: along the hose's line there is but one
        replace(added("tether.stiffness", "N/m", 0.2 * weight / length, first), also=(first + 1, first + 2)),
        added("tether.preload", "N", PULL * weight, block + place.TETHER_PRELOAD),
    )
    entry = block + place.TETHER_REACH
    parts = tuple(
        added(f"tether.reach.{a}", "m", size, entry + i, float(reach[i])) for i, a in enumerate(AXES)
    )
    usual = DAMPED * weight / length
    damping = replace(
        added("tether.damping", "N*s/m", DAMPED_SPREAD, block + place.TETHER_DAMPING, usual), ratio=True
    )

    def told(found: Estimates) -> Told:
        out: Told = {
            "stiffness": (*found.of("tether.stiffness"), "N/m"),
            "preload": (*found.of("tether.preload"), "N"),
            "damping": (*found.of("tether.damping"), "N*s/m"),
        }
        out |= {f"point_{a}": (*found.of(f"tether.point.{a}"), "m") for a in AXES}
        return out | {f"reach_{a}": (*found.of(f"tether.reach.{a}"), "m") for a in AXES}

    return Candidate(
        "tether",
        (*amounts, damping, *parts, *_point(rig)),
        "A hose or wire runs from the body to a point of the room; it pulls with {told[preload]} at rest and "
        "has a stiffness of {value}.",
        ADVICE,
        {"channel": None, "axis": None},
        positive=1,
        either_way=1,
        tell=told,
    )


def _lines(mass: float, problem: Problem, evaluation: Evaluation) -> list[tuple[Candidate, dict[str, float]]]:
    """A hose between two points as a fitted spring has it, along that one's pull at rest."""
    parameters, theta = problem.bench.parameters, evaluation.point.theta
    physics = parameters.physics(theta)
    block = layout.effects_offset(parameters.model.cables)
    stiffness = physics[block + place.TETHER_STIFFNESS :][:3]
    pull = physics[block + place.TETHER_PULL :][:3]
    at = physics[block + place.TETHER_POINT :][:3]
    size = float(np.linalg.norm(pull))
    most = float(np.max(stiffness))
    if most <= 0.0 or size == 0.0:
        return []
    reach = HOSE * pull / size
    known = {"tether.stiffness": most, "tether.preload": size}
    known |= {f"tether.reach.{a}": float(v) for a, v in zip(AXES, reach, strict=True)}
    known |= {f"tether.point.{a}": float(v) for a, v in zip(AXES, at, strict=True)}
    return [(_line(problem.bench.rig, mass, reach), known)]


def _hoses(mass: float, problem: Problem, evaluation: Evaluation) -> list[tuple[Candidate, dict[str, float]]]:
    """Hoses to a wall on either side, or on the one that a pull tells which never comes off.

    They run along the axis on which that spring is stiffest. mass: kg, roughly.
    """
    parameters, theta = problem.bench.parameters, evaluation.point.theta
    physics = parameters.physics(theta)
    block = layout.effects_offset(parameters.model.cables)
    stiffnesses = physics[block + place.TETHER_STIFFNESS :][:3]
    along = int(np.argmax(stiffnesses))
    axis, stiffness = AXES[along], float(stiffnesses[along])
    if stiffness <= 0.0:
        return []
    at = physics[block + place.TETHER_POINT :][:3]
    model = parameters.model
    moved = np.concatenate([travel_of(model, r.motion, at)[:, along] for r in evaluation.runs])
    let_go = stiffness * float(np.max(np.abs(moved)))
    # A pull that never comes off is where the fit of the spring stands, and leads nowhere
    pulls = {1.0: 0.5 * let_go, -1.0: -0.5 * let_go}
    told = estimates(problem, evaluation)
    pull = f"tether.pull.{axis}"
    if pull in told.values and abs(told.values[pull]) - CERTAIN * told.std(pull) > let_go:
        # Taut all the time: it only turns with the body
        pulls = {float(np.sign(told.values[pull])): told.values[pull]}
    known = {f"tether.stiffness.{axis}": stiffness} | {
        f"tether.point.{a}": float(value) for a, value in zip(AXES, at, strict=True)
    }
    return [
        (
            _hose(axis, side, problem.bench.rig, mass),
            known | {f"tether.pull.{axis}": start, f"tether.reach.{axis}": side * HOSE},
        )
        for side, start in pulls.items()
    ]


def placed_tethers(
    wide: Problem, evaluation: Evaluation, beyond: Beyond, candidates: Sequence[Candidate]
) -> list[tuple[Candidate, float, dict[str, float]]]:
    """Each tether where it promises most: candidate, gain (nats), values.

    Near the noise a hose along one axis may promise no more than a pull.

    wide: the problem of ``evaluation`` with the tethers' parameters free, none of them in its model so far.
    """
    chosen = [c for c in candidates if c.effect == "tether"]
    free = {q.name: (i, q) for i, q in enumerate(wide.bench.parameters.free, start=INERTIAL)}
    names = [f"tether.{what}.{a}" for what in ("stiffness", "pull") for a in AXES]
    if not chosen or any(name not in free for name in names):
        return []
    index = [free[name][0] for name in names]
    points = [free[f"tether.point.{a}"] for a in AXES]
    if np.any(evaluation.point.theta[index] != 0.0):
        return []
    stds = np.array([free[name][1].prior_std for name in names])
    middle, spread = np.array([q.nominal for _, q in points]), points[0][1].prior_std
    runs = [
        whitened_response(run, _wrenches(wide, run.motion, middle, spread, stds), smooth=True)
        for run in evaluation.runs
    ]
    rests = _at_rest(wide, evaluation.point, index, [i for i, _ in points])
    if rests is None:
        return []
    found = beyond.of(runs, rests)
    matrix = found.information((*runs, *rests)).reshape(len(names), TERMS, len(names), TERMS)
    right = found.right.reshape(len(names), TERMS)
    near = misfit(evaluation) < NEAR_SQUARE
    out: list[tuple[Candidate, float, dict[str, float]]] = []
    for candidate in chosen:
        own = [q for q in candidate.parameters if not q.name.startswith("tether.point.")]
        mixed = _mixing(own, [free[name][1] for name in names])
        best = best_place(
            np.einsum("ia,atbs,jb->itjs", mixed, matrix, mixed, optimize=True),
            mixed @ right,
            np.ones(len(own)),
            candidate.positive,
            1.0,
            REACH,
        )
        steady = best is not None and best.positive < STIFF
        if best is None or (steady and (not near or candidate.positive > 1)):
            out.append((candidate, 0.0, {}))
        else:
            out.append((candidate, best.gain, _values(own, [q for _, q in points], best)))
    return out


def _wrenches(problem: Problem, motion: Motion, middle: Array, spread: float, stds: Array) -> Array:
    """(N, 6, 6 TERMS) wrench of a std of stiffness and of pull along each world axis, by place."""
    R = motion.R_world_body
    at = lines(R.shape[0], middle, spread)
    moved = travel(problem.bench.parameters.model, motion, at)
    out: list[Array] = []
    for axis in range(3):
        along = R[:, axis, :, None]
        out.append(stds[axis] * placed_wrench(-along * moved[:, axis, None, :], at))
    for axis in range(3):
        steady = np.zeros(at.shape)
        steady[..., 0] = R[:, axis]
        out.append(stds[3 + axis] * placed_wrench(steady, at))
    return np.concatenate(out, axis=2)


def _at_rest(wide: Problem, point: Point, index: list[int], points: list[int]) -> list[Array] | None:
    """(m, 6 TERMS) columns of the rest poses, from their derivatives at ten places."""
    still = replace(wide, runs=())
    stacked: list[list[Array]] = []
    for u in design():
        theta = point.theta.copy()
        theta[points] = REACH * u
        at = evaluate(still, Point(theta, (), point.rest_guesses))
        if at is None:
            return None
        stacked.append([rest.jacobian[:, index] for rest in at.rests])
    weights = np.linalg.inv(monomials(REACH * design()))
    return [
        np.einsum("tp,pma->mat", weights, np.array(parts)).reshape(-1, len(index) * TERMS)
        for parts in zip(*stacked, strict=True)
    ]


def _mixing(own: Sequence[Parameter], columns: Sequence[Parameter]) -> Array:
    """(o, c): what a unit of each parameter of ``own`` is of each of ``columns``."""
    entry = {q.index: k for k, q in enumerate(columns)}
    mixed = np.zeros((len(own), len(columns)))
    for row, q in enumerate(own):
        for index in (q.index, *q.also):
            mixed[row, entry[index]] = q.prior_std / columns[entry[index]].prior_std
    return mixed


def _values(own: Sequence[Parameter], points: Sequence[Parameter], best: Best) -> dict[str, float]:
    values = {q.name: q.value(amount) for q, amount in zip(own, best.amounts, strict=True)}
    return values | {q.name: q.value(u) for q, u in zip(points, best.place, strict=True)}
