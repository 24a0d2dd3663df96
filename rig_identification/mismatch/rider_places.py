"""Riders once more, where the first scan found them: finer in frequency and damping, and at every place.

The first scan lets a rider feel the acceleration of the body's middle, at frequencies a tenth apart and
with one damping. Half a minute of a liquid that swings freely tells its frequency to less than a percent, and
a tank at the end of a vehicle feels another acceleration than one in its middle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from rig_identification.estimate.first_guess import extent
from rig_identification.estimate.parameters import AXES
from rig_identification.estimate.solve import Evaluation, Problem
from rig_identification.mismatch.beyond import Beyond, Columns
from rig_identification.mismatch.places import TERMS, Best, best_place, crossed, lines, placed_wrench
from rig_identification.mismatch.response import whitened_response
from rig_identification.mismatch.riders import DIRECTIONS, Swing, filters, middle_of, pieces_of
from rig_identification.model import layout
from rig_identification.model.effects import place

Array = NDArray[np.float64]

#: Factors on the frequency, coarse and then fine, and damping ratios that are tried.
COARSE = tuple(float(f) for f in np.geomspace(0.9, 1.11, 9))
FINE = tuple(float(f) for f in np.geomspace(0.985, 1.015, 5))
DAMPINGS = (0.006, 0.03, 0.12)
#: Places lie within so much of ``spread_of`` about the middle.
REACH = 1.2


@dataclass(frozen=True)
class Ridden:
    """A rider where it explains most."""

    swing: Swing
    damping: float  # ratio
    best: Best  # kg, at a place in units of ``spread_of`` from the middle
    columns: Columns
    runs: list[Array]  # (m, TERMS) its columns in every run


def finer(problem: Problem, beyond: Beyond, swing: Swing, mass: float) -> Ridden | None:
    """The best frequency, damping and place near those of ``swing``; None where no mass promises anything.

    mass: kg, of the body.
    """
    best: Ridden | None = None
    for factors in (COARSE, FINE):
        center = swing if best is None else best.swing
        for factor in factors:
            tried = replace(center, frequency=center.frequency * factor)
            found = _best_damping(problem, beyond, tried, mass)
            if found is not None and (best is None or found.best.gain > best.best.gain):
                best = found
    return best


def _best_damping(problem: Problem, beyond: Beyond, swing: Swing, mass: float) -> Ridden | None:
    wrenches = _wrenches(problem, beyond.full, swing)
    responses = [whitened_response(run, wrenches[i], smooth=True) for i, run in enumerate(beyond.full.runs)]
    found = beyond.of(responses)
    best: Ridden | None = None
    for k, damping in enumerate(DAMPINGS):
        chosen = slice(TERMS * k, TERMS * (k + 1))
        columns = found.part(chosen)
        own = [r[:, chosen] for r in responses]
        at = best_place(
            columns.information(own).reshape(1, TERMS, 1, TERMS),
            columns.right.reshape(1, TERMS),
            np.array([1.0 / (0.05 * mass) ** 2]),
            1,
            1.0,
            REACH,
        )
        if at is not None and (best is None or at.gain > best.best.gain):
            best = Ridden(swing, damping, at, columns, own)
    return best


def spread_of(problem: Problem) -> float:
    """m: unit in which places are given from the middle."""
    return 0.5 * float(np.max(extent(problem.bench.rig)))


def _wrenches(problem: Problem, evaluation: Evaluation, swing: Swing) -> dict[int, Array]:
    """(N, 6, TERMS len(DAMPINGS)) wrench per kilogram, by place, for each run of the problem."""
    model = problem.bench.parameters.model
    first = layout.effects_offset(model.cables) + place.REFERENCE_ROTATION
    down = model.physics[first : first + 9].reshape(3, 3).T @ model.physics[:3]
    out: dict[int, Array] = {}
    for which in pieces_of(problem).values():
        raw = np.concatenate(
            [evaluation.runs[i].motion.outputs[: None if i == which[-1] else -1] for i in which]
        )
        step = problem.runs[which[0]].grid.step
        at = lines(raw.shape[0], middle_of(problem.bench.rig), spread_of(problem))
        felt = _felt(raw, at)
        tilted = raw[0, layout.OUT_GRAVITY : layout.OUT_GRAVITY + 3] - down
        both = [_swung(felt, down, tilted, at, swing, damping, step) for damping in DAMPINGS]
        wrench, start = np.concatenate(both, axis=2), 0
        for i in which:
            nodes = problem.runs[i].grid.nodes
            out[i] = wrench[start : start + nodes]
            start += nodes - 1
    return out


def _felt(raw: Array, at: Array) -> Array:
    """(N, 3, 4) specific force at the place, body axes."""
    f = raw[:, layout.OUT_SPECIFIC_FORCE : layout.OUT_SPECIFIC_FORCE + 3]
    w = raw[:, layout.OUT_RATE : layout.OUT_RATE + 3, None]
    alpha = raw[:, layout.OUT_ANGULAR_ACCELERATION : layout.OUT_ANGULAR_ACCELERATION + 3, None]
    felt = np.cross(alpha, at, axis=1) + np.cross(w, np.cross(w, at, axis=1), axis=1)
    felt[..., 0] += f
    return np.asarray(felt)


def _swung(
    felt: Array, down: Array, tilted: Array, at: Array, swing: Swing, damping: float, step: float
) -> Array:
    """(N, 6, TERMS) wrench of a kilogram that swings less that of one that is fixed."""
    omega = 2.0 * np.pi * swing.frequency
    numerator, denominator = filters(swing.frequency, step, damping)
    out = np.zeros((felt.shape[0], 6, TERMS))
    for axis in DIRECTIONS[swing.directions]:
        i = AXES.index(axis)
        force = felt[:, i].copy()
        force[:, 0] += down[i]
        away, before = force.copy(), np.zeros(4)
        # Displaced by its weight before the start: the deviation from there starts from zero
        away[:, 0] += tilted[i]
        before[0] = tilted[i] / omega**2
        q = np.asarray(lfilter(numerator, denominator, away, axis=0)) + before
        rate = np.gradient(q, step, axis=0)
        push, travel = np.zeros(felt.shape), np.zeros(felt.shape)
        push[:, i] = force + 2.0 * damping * omega * rate + omega**2 * q
        travel[:, i] = q
        out += placed_wrench(push, at)
        out[:, 3:] -= crossed(travel, felt)
    return out
