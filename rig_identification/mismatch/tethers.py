"""A hose or wire that pulls on the body: where it does, what is told of it, and what it promises.

To first order a tether of stiffness k along d at the place p of the body puts the force -k d d^T (u + t x p)
there, u and t being the body's travel and turn: a polynomial of second degree in p (places.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rig_identification.estimate.first_guess import extent
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
)
from rig_identification.mismatch.response import whitened_response
from rig_identification.model import layout
from rig_identification.model.effects import place
from rig_identification.model.motion import Motion
from rig_identification.rig import Rig

Array = NDArray[np.float64]

#: Length (m) of a hose that pulls as hard as any would and resists sideways most.
SHORT_HOSE = 1.0
#: Places lie within so much of the rig's longest side about the middle.
REACH = 0.6
#: Gain (nats) of a tether's stiffness beyond its pull: what pulls steadily alone is no tether.
STIFF = 3.0


def tethers(rig: Rig, mass: float) -> list[Candidate]:
    """A tether along each axis, and one along all. mass: kg, roughly."""
    return [_tether(axes, rig, mass) for axes in (*AXES, "".join(AXES))]


def _middle(rig: Rig) -> Array:
    """(3,) m: the middle of a body that hangs below its hinges."""
    points = np.array([c.body_point for c in rig.cables])
    return np.asarray(np.mean(points, axis=0) - [0.0, 0.0, 0.3 * float(np.max(extent(rig)))])


def _tether(axes: str, rig: Rig, mass: float) -> Candidate:
    """A tether that pulls along ``axes``: along one as a taut hose does, along all as one that hangs.

    What is taut resists sideways as well, by its pull over its length F0/l alike to both sides: too little to
    show by itself, and enough to stand for a centre of mass that lies millimetres higher.
    """
    block = layout.effects_offset(len(rig.cables))
    length = float(np.mean([c.length for c in rig.cables]))
    spring, pull = 0.2 * mass * rig.gravity / length, 0.02 * mass * rig.gravity
    size, middle = float(np.max(extent(rig))), _middle(rig)
    parts = [
        added(f"tether.{what}.{a}", unit, std, block + entry + AXES.index(a))
        for what, unit, std, entry in (
            ("stiffness", "N/m", spring, place.TETHER_STIFFNESS),
            ("pull", "N", pull, place.TETHER_PULL),
        )
        for a in axes
    ]
    if len(axes) == 1:
        first, second = (block + place.TETHER_STIFFNESS + i for i, a in enumerate(AXES) if a != axes)
        aside = added("tether.sideways", "N/m", pull / SHORT_HOSE, first)
        parts.append(replace(aside, also=(second,)))
    parts += [
        added(f"tether.point.{a}", "m", size, block + place.TETHER_POINT + i, float(middle[i]))
        for i, a in enumerate(AXES)
    ]

    def told(values: dict[str, float], stds: dict[str, float]) -> Told:
        stiff = {a: values[f"tether.stiffness.{a}"] for a in axes}
        main = max(stiff, key=lambda a: abs(stiff[a]))
        out: Told = {"stiffness": (stiff[main], stds[f"tether.stiffness.{main}"], "N/m")}
        for p in parts:
            _, what, *a = p.name.split(".")
            if what == "point" or len(axes) > 1:
                out["_".join([what, *a])] = (values[p.name], stds[p.name], p.unit)
            elif what == "pull":
                out["preload"] = (abs(values[p.name]), stds[p.name], p.unit)
        return out

    return Candidate(
        "tether",
        tuple(parts),
        "A hose or wire pulls on the body with a stiffness of {value}.",
        "Let cables and hoses hang free in a long loop, or take them off.",
        {"channel": None, "axis": axes if len(axes) == 1 else None},
        positive=len(axes),
        tell=told,
    )


def placed_tethers(
    wide: Problem, evaluation: Evaluation, beyond: Beyond, candidates: Sequence[Candidate]
) -> list[tuple[Candidate, float, dict[str, float]]]:
    """Each tether at the place at which it promises most: candidate, gain (nats) and values.

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
        if best is None or best.positive < STIFF:
            out.append((candidate, 0.0, {}))
        else:
            out.append((candidate, best.gain, _values(own, [q for _, q in points], best)))
    return out


def _wrenches(problem: Problem, motion: Motion, middle: Array, spread: float, stds: Array) -> Array:
    """(N, 6, 6 TERMS) wrench of a std of stiffness and of pull along each world axis, by place."""
    model = problem.bench.parameters.model
    first = layout.effects_offset(model.cables) + place.REFERENCE_POSITION
    turn = layout.effects_offset(model.cables) + place.REFERENCE_ROTATION
    R = motion.R_world_body
    at = lines(R.shape[0], middle, spread)
    moved = (R - model.physics[turn : turn + 9].reshape(3, 3)) @ at
    moved[..., 0] += motion.outputs[:, layout.OUT_POSITION : layout.OUT_POSITION + 3]
    moved[..., 0] -= model.physics[first : first + 3]
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
